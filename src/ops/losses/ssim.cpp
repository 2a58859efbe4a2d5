#include "ops/losses/ssim.h"

#include "core/checked_math.h"
#include "params/image_loss_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

constexpr std::uint64_t kForwardPlanes = 4;  // p, p^2, q, q^2 of similarity.glsl
constexpr std::uint64_t kSlopes = 3;         // by the means, p^2, q^2
constexpr double kTaps = 11;

struct Stage {
    const char* kernel;
    std::vector<vk::Access> accesses;
    double planes;     ///< planes that the window goes over
    bool sum = false;  ///< a workgroup per chunk, not an invocation per quad
};

Status record(vk::Recorder& recorder, const SsimDesc& desc, Stage pass) {
    const QuadDims dims = desc.quads();
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = pass.sum ? vk::groups_for(recorder.device(), loss_chunks(dims), 1)
                                       : vk::groups_for(recorder.device(), dims.quads(), size);
    const double bytes = static_cast<double>(dims.bytes());
    return recorder.dispatch({
        .op = pass.kernel,
        .shader = pass.kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::ImageLossParams{desc.n, desc.c, desc.height, desc.width,
                                        static_cast<std::uint32_t>(dims.quads()), kLossChunk,
                                        loss_scale(dims), groups[0]},
        .accesses = std::move(pass.accesses),
        .groups = groups,
        .work = {.flops = kTaps * pass.planes * bytes / 2, .bytes = 2 * pass.planes * bytes},
    });
}

constexpr const char* kSsimSaved[] = {"slopes"};

std::uint64_t plane_bytes(const SsimDesc& desc, std::uint64_t planes) {
    return planes * desc.quads().bytes();
}

SsimDesc ssim_desc(const Shape& a) {
    return {a[0], a[1], a[2], a[3]};
}

/// Offset of the workspace behind the rows.
std::uint64_t rows_end(const vk::Recorder& recorder, const SsimDesc& desc) {
    return round_up(plane_bytes(desc, kForwardPlanes), recorder.device().limits.offset_alignment);
}

Result<OpPlan> ssim_plan(const vk::Recorder& recorder, const Attributes&,
                         std::span<const Shape> inputs) {
    SPLAT_TRY(expect_images("ssim", "a", inputs[0]));
    SPLAT_ASSIGN(OpPlan plan, loss_plan("ssim", inputs));
    const SsimDesc desc = ssim_desc(inputs[0]);
    const std::uint64_t slopes = plane_bytes(desc, kSlopes) / 4;
    if (slopes > kMaxElements)
        return unsupported("ssim: images %s are too large: %llu slopes", inputs[0].text().c_str(),
                           llu(slopes));
    plan.saved = {Shape{static_cast<std::uint32_t>(slopes)}};
    plan.forward_workspace += rows_end(recorder, desc);
    plan.backward_workspace = plane_bytes(desc, kSlopes);
    return plan;
}

Status ssim_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    const SsimDesc desc = ssim_desc(v.inputs[0].shape);
    const vk::BufferView rows = v.workspace.part(0, plane_bytes(desc, kForwardPlanes));
    const vk::BufferView partial =
        v.workspace.part(rows_end(recorder, desc), loss_partial_bytes(desc.quads()));
    SPLAT_TRY(record(recorder, desc,
                     {"ssim_forward_rows",
                      {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::write(rows)},
                      kForwardPlanes}));
    SPLAT_TRY(record(recorder, desc,
                     {"ssim_forward",
                      {vk::read(rows), vk::write(v.saved[0]), vk::write(partial)},
                      kForwardPlanes,
                      true}));
    return loss_sum(recorder, desc.quads(), partial, v.outputs[0]);
}

Status ssim_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    const SsimDesc desc = ssim_desc(v.inputs[0].shape);
    const vk::BufferView rows = v.workspace.part(0, plane_bytes(desc, kSlopes));
    SPLAT_TRY(record(recorder, desc,
                     {"ssim_backward_rows", {vk::read(v.saved[0]), vk::write(rows)}, kSlopes}));
    return record(recorder, desc,
                  {"ssim_backward",
                   {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::read(rows),
                    vk::read(v.grad_outputs[0]), vk::write(v.grad_inputs[0])},
                   kSlopes});
}

}  // namespace

const OpRow kSsimRow = {
    .name = "ssim",
    .equation =
        "loss = mean (2 ma mb + C1) (2 cov + C2) / ((ma^2 + mb^2 + C1) (var_a + var_b + C2)), "
        "Gaussian window 11x11 of 1.5 pixels, zero padding, C1 = 1e-4, C2 = 9e-4",
    .inputs = kLossInputs,
    .outputs = kLossOutputs,
    .saved = kSsimSaved,
    .plan = ssim_plan,
    .forward = ssim_row_forward,
    .backward = ssim_row_backward};

}  // namespace splat::ops
