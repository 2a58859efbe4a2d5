#include "ops/losses/edge_loss.h"

#include "params/image_loss_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

constexpr std::uint64_t kSlopePlanes = 2;  // along x and y
constexpr double kFlops = 60;              // per element and pass: nine taps of two filters

struct EdgePass {
    const char* kernel;
    std::vector<vk::Access> accesses;
    bool sum;  ///< a workgroup per chunk, not an invocation per quad
};

Status record(vk::Recorder& recorder, const EdgeLossDesc& desc, EdgePass pass) {
    const QuadDims dims = desc.quads();
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = pass.sum ? vk::groups_for(recorder.device(), loss_chunks(dims), 1)
                                       : vk::groups_for(recorder.device(), dims.quads(), size);
    const double bytes = static_cast<double>(dims.bytes());
    return recorder.dispatch({
        .op = pass.kernel,
        .shader = pass.kernel,
        .constants = {{params::kWorkgroupSizeId, size},
                      {params::kImageLossScharrId, desc.scharr ? 1U : 0U},
                      {params::kImageLossWeightedId, desc.weighted ? 1U : 0U}},
        .push = params::ImageLossParams{desc.n, desc.c, desc.height, desc.width,
                                        static_cast<std::uint32_t>(dims.quads()), kLossChunk,
                                        loss_scale(dims), groups[0]},
        .accesses = std::move(pass.accesses),
        .groups = groups,
        .work = {.flops = kFlops * bytes / 4, .bytes = 4 * bytes},
    });
}

constexpr Port kEdgeLossInputs[] = {
    {"a"}, {"b", Layout::kQuads, false, true}, {"weight", Layout::kQuads, true, true}};
constexpr const char* kEdgeLossSaved[] = {"slopes"};
constexpr Attribute kEdgeLossAttributes[] = {
    {"scharr", "boolean", "false", "Scharr's filter instead of Sobel's."}};

EdgeLossDesc edge_loss_desc(const Attributes& attributes, const Shape& a, bool weighted) {
    return {a[0], a[1], a[2], a[3], attributes.boolean("scharr"), weighted};
}

Result<OpPlan> edge_loss_plan(const vk::Recorder&, const Attributes& attributes,
                              std::span<const Shape> inputs) {
    const Shape& a = inputs[0];
    SPLAT_TRY(expect_images("edge_loss", "a", a));
    SPLAT_ASSIGN(OpPlan plan, loss_plan("edge_loss", inputs));
    const bool weighted = inputs[2].rank() > 0;
    if (weighted)
        SPLAT_TRY(expect_shape("edge_loss", "weight", inputs[2], Shape{a[0], 1, a[2], a[3]}));
    const std::uint64_t slopes =
        kSlopePlanes * edge_loss_desc(attributes, a, weighted).quads().bytes() / 4;
    if (slopes > kMaxElements)
        return unsupported("edge_loss: images %s are too large: %llu slopes", a.text().c_str(),
                           llu(slopes));
    plan.saved = {Shape{static_cast<std::uint32_t>(slopes)}};
    return plan;
}

Status edge_loss_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                             const OpViews& v) {
    const EdgeLossDesc desc = edge_loss_desc(attributes, v.inputs[0].shape, present(v.inputs[2]));
    const vk::BufferView partial = v.workspace.part(0, loss_partial_bytes(desc.quads()));
    SPLAT_TRY(record(
        recorder, desc,
        {"edge_loss_forward",
         {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::read(v.inputs[desc.weighted ? 2 : 1]),
          vk::write(v.saved[0]), vk::write(partial)},
         true}));
    return loss_sum(recorder, desc.quads(), partial, v.outputs[0]);
}

Status edge_loss_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                              const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    const EdgeLossDesc desc = edge_loss_desc(attributes, v.grad_inputs[0].shape, false);
    return record(recorder, desc,
                  {"edge_loss_backward",
                   {vk::read(v.saved[0]), vk::read(v.grad_outputs[0]), vk::write(v.grad_inputs[0])},
                   false});
}

}  // namespace

const OpRow kEdgeLossRow = {
    .name = "edge_loss",
    .equation =
        "loss = mean weight (|Dx (a - b)| + |Dy (a - b)|), Dx and Dy Sobel's or Scharr's "
        "derivative, reflected at the border",
    .inputs = kEdgeLossInputs,
    .outputs = kLossOutputs,
    .saved = kEdgeLossSaved,
    .attributes = kEdgeLossAttributes,
    .plan = edge_loss_plan,
    .forward = edge_loss_row_forward,
    .backward = edge_loss_row_backward,
    .backward_reads = no_backward_reads};

}  // namespace splat::ops
