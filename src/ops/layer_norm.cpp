#include "ops/layer_norm.h"

#include <cmath>

#include "params/layer_norm_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

/// A lane walks its pixel's channels three times, a quad a turn; sums of squares hold so many numbers.
constexpr std::uint32_t kMaxPixelChannels = 4 * vk::kMaxTurns;
/// Up to 1024 lanes of the gradients of gamma and beta walk over the pixels.
constexpr std::uint64_t kMaxColumns = 1024 * vk::kMaxTurns;

std::uint64_t columns_of(const LayerNormDesc& desc) {
    return std::uint64_t{desc.x.n} * desc.x.p;
}

params::LayerNormParams params_of(const LayerNormDesc& desc, bool accumulate,
                                  const vk::Groups& groups) {
    return {desc.x.c, static_cast<std::uint32_t>(columns_of(desc)), desc.eps, accumulate ? 1U : 0U,
            groups[0]};
}

/// A pass over pixels. On GPUs 16 lanes share one, as images of few pixels would leave most of the device idle; on CPU
/// devices few pixels are a workgroup, so that there are enough for all threads.
Status record_pixels(vk::Recorder& recorder, const char* kernel, const LayerNormDesc& desc,
                     std::vector<vk::Access> accesses, const vk::Work& work) {
    const bool gpu = recorder.kernels() == vk::Kernels::kGpu;
    const bool cpu = recorder.kernels() == vk::Kernels::kCpu;
    const std::uint32_t size = vk::workgroup_size(recorder.device(), gpu ? 256 : cpu ? 16 : 64);
    const std::uint32_t lanes = gpu ? std::min(16U, size) : 1;
    const vk::Groups groups = vk::groups_for(recorder.device(), columns_of(desc) * lanes, size);
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}, {params::kLayerNormLanesId, lanes}},
        .push = params_of(desc, false, groups),
        .accesses = std::move(accesses),
        .groups = groups,
        .work = work,
        .may_alias = true,  // the lanes of a pixel have read it when they write it
    });
}

Status record_parameters(vk::Recorder& recorder, const LayerNormDesc& desc, const OpViews& v,
                         const vk::BufferView& grad_gamma, const vk::BufferView& grad_beta) {
    const bool cpu = recorder.kernels() == vk::Kernels::kCpu;
    const std::uint32_t size =
        vk::workgroup_size(recorder.device(), cpu ? 8 : 256, columns_of(desc));
    const std::uint32_t quads = (desc.x.c + 3) / 4;
    const vk::Groups groups = vk::groups_for(recorder.device(), std::uint64_t{quads} * size, size);
    const double elements = static_cast<double>(desc.x.quads()) * 4;
    return recorder.dispatch({
        .op = "layer_norm_backward_params",
        .shader = "layer_norm_backward_params",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params_of(desc, v.accumulate, groups),
        .accesses = {vk::read(v.inputs[0]), vk::read(v.saved[0]), vk::read(v.saved[1]),
                     vk::read(v.grad_outputs[0]), vk::read_write(grad_gamma),
                     vk::read_write(grad_beta)},
        .groups = groups,
        .work = {.flops = 6 * elements, .bytes = 8 * elements},
    });
}

}  // namespace

Status layer_norm_check(const LayerNormDesc& desc) {
    if (!std::isfinite(desc.eps) || desc.eps <= 0)
        return invalid("layer_norm: eps is %g, expected a finite number > 0",
                       static_cast<double>(desc.eps));
    if (desc.x.c > kMaxPixelChannels)
        return unsupported("layer_norm: %u channels, expected at most %u", desc.x.c,
                           kMaxPixelChannels);
    if (columns_of(desc) > kMaxColumns)
        return unsupported("layer_norm: %llu pixels, expected at most %llu", llu(columns_of(desc)),
                           llu(kMaxColumns));
    return {};
}

namespace {

constexpr Port kLayerNormInputs[] = {
    {"x"}, {"gamma", Layout::kRowMajor}, {"beta", Layout::kRowMajor}};
constexpr const char* kLayerNormSaved[] = {"mean", "rstd"};
constexpr Attribute kLayerNormAttributes[] = {
    {"eps", "number", "1e-6", "added to the variance; > 0"},
};

Result<LayerNormDesc> layer_norm_desc(const Attributes& attributes, const Shape& x) {
    if (x.rank() < 2)
        return error(Code::kShape, "layer_norm: tensor 'x' has shape %s, expected [N, C, ...]",
                     x.text().c_str());
    LayerNormDesc desc;
    SPLAT_ASSIGN(desc.x, quad_dims(x));
    desc.eps = static_cast<float>(attributes.number("eps"));
    return desc;
}

Result<OpPlan> layer_norm_plan(const vk::Recorder&, const Attributes& attributes,
                               std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const LayerNormDesc desc, layer_norm_desc(attributes, inputs[0]));
    SPLAT_TRY(layer_norm_check(desc));
    SPLAT_TRY(expect_shape("layer_norm", "gamma", inputs[1], {desc.x.c}));
    SPLAT_TRY(expect_shape("layer_norm", "beta", inputs[2], {desc.x.c}));
    const auto columns = static_cast<std::uint32_t>(columns_of(desc));
    return OpPlan{.outputs = {inputs[0]},
                  .saved = {{2, columns}, {columns}},
                  .backward_workspace = vk::quad_bytes(desc.x.c)};
}

Status layer_norm_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                              const OpViews& v) {
    SPLAT_ASSIGN(const LayerNormDesc desc, layer_norm_desc(attributes, v.inputs[0].shape));
    const double elements = static_cast<double>(desc.x.quads()) * 4;
    return record_pixels(recorder, "layer_norm_forward", desc,
                         {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::read(v.inputs[2]),
                          vk::write(v.outputs[0]), vk::write(v.saved[0]), vk::write(v.saved[1])},
                         {.flops = 10 * elements, .bytes = 8 * elements});
}

Status layer_norm_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                               const OpViews& v) {
    SPLAT_ASSIGN(const LayerNormDesc desc, layer_norm_desc(attributes, v.inputs[0].shape));
    const double elements = static_cast<double>(desc.x.quads()) * 4;
    if (present(v.grad_inputs[0]))
        SPLAT_TRY(record_pixels(
            recorder, "layer_norm_backward", desc,
            {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::read(v.saved[0]),
             vk::read(v.saved[1]), vk::read(v.grad_outputs[0]), vk::write(v.grad_inputs[0])},
            {.flops = 16 * elements, .bytes = 12 * elements}));
    const vk::BufferView& grad_gamma = v.grad_inputs[1];
    const vk::BufferView& grad_beta = v.grad_inputs[2];
    if (!present(grad_gamma) && !present(grad_beta)) return {};
    // If only one of the pair is requested, the other is written to the workspace.
    const vk::BufferView unwanted = v.workspace.part(0, vk::quad_bytes(desc.x.c));
    return record_parameters(recorder, desc, v, present(grad_gamma) ? grad_gamma : unwanted,
                             present(grad_beta) ? grad_beta : unwanted);
}

}  // namespace

const OpRow kLayerNormRow = {
    .name = "layer_norm",
    .equation = "y = gamma * (x - mean) / sqrt(var + eps) + beta over the channels of each pixel",
    .inputs = kLayerNormInputs,
    .outputs = kOutputY,
    .saved = kLayerNormSaved,
    .attributes = kLayerNormAttributes,
    .plan = layer_norm_plan,
    .forward = layer_norm_row_forward,
    .backward = layer_norm_row_backward};

}  // namespace splat::ops
