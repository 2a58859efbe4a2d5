#include "ops/losses/feature_distance.h"

#include "params/feature_distance_params.h"

namespace splat::ops {
namespace {

/// One workgroup sums an image: turns of its loop, see kMaxTurns in vk/launch.h.
constexpr std::uint32_t kMaxPixels = 1U << 20;

/// The gradient takes four turns for each quad of channels where a length is 0 or overflows.
constexpr std::uint32_t kMaxChannels = 64000;

params::FeatureDistanceParams params_of(const QuadDims& dims, std::uint32_t groups_x) {
    return {dims.c, dims.n, dims.p, static_cast<float>(1.0 / dims.p), groups_x};
}

}  // namespace

Status feature_distance_check(const QuadDims& dims) {
    if (dims.c > kMaxChannels)
        return unsupported("feature_distance: %u channels, expected at most %u", dims.c,
                           kMaxChannels);
    if (dims.p < kMaxPixels) return {};
    return unsupported("feature_distance: images of %u pixels, expected fewer than %u", dims.p,
                       kMaxPixels);
}

namespace {

/// Bytes of the terms of all pixels.
std::uint64_t partial_bytes(const QuadDims& dims) {
    return vk::quad_bytes(std::uint64_t{dims.n} * dims.p);
}

constexpr Port kFeatureDistanceInputs[] = {
    {"a"}, {"b", Layout::kQuads, false, true}, {"weight", Layout::kRowMajor, false, true}};

Result<OpPlan> feature_distance_plan(const vk::Recorder&, const Attributes&,
                                     std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(inputs[0]));
    SPLAT_TRY(expect_shape("feature_distance", "b", inputs[1], inputs[0]));
    SPLAT_TRY(expect_shape("feature_distance", "weight", inputs[2], {dims.c}));
    SPLAT_TRY(feature_distance_check(dims));
    return OpPlan{.outputs = {Shape{dims.n, 1}}, .forward_workspace = partial_bytes(dims)};
}

Status feature_distance_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(v.inputs[0].shape));
    const vk::BufferView partial = v.workspace.part(0, partial_bytes(dims));
    const std::uint64_t pixels = std::uint64_t{dims.n} * dims.p;
    const double bytes = static_cast<double>(dims.bytes());
    SPLAT_TRY(record_each(recorder,
                          {.kernel = "feature_distance_forward",
                           .items = pixels,
                           .accesses = {vk::read(v.inputs[0]), vk::read(v.inputs[1]),
                                        vk::read(v.inputs[2]), vk::write(partial)},
                           .work = {.flops = 2.5 * bytes, .bytes = 2 * bytes}},
                          [&](std::uint32_t groups_x) { return params_of(dims, groups_x); }));
    const vk::Groups images = vk::groups_for(recorder.device(), dims.n, 1);
    const double sums = static_cast<double>(pixels);
    return recorder.dispatch({
        .op = "feature_distance_forward_sum",
        .shader = "feature_distance_forward_sum",
        .constants = {{params::kWorkgroupSizeId, vk::workgroup_size(recorder.device(), 64)}},
        .push = params_of(dims, images[0]),
        .accesses = {vk::read(partial), vk::write(v.outputs[0])},
        .groups = images,
        .work = {.flops = sums, .bytes = 4 * sums},
    });
}

Status feature_distance_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(v.inputs[0].shape));
    const double bytes = static_cast<double>(dims.bytes());
    return record_each(
        recorder,
        {.kernel = "feature_distance_backward",
         .items = std::uint64_t{dims.n} * dims.p,
         .accesses = {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::read(v.inputs[2]),
                      vk::read(v.grad_outputs[0]), vk::write(v.grad_inputs[0])},
         .work = {.flops = 6 * bytes, .bytes = 3 * bytes}},
        [&](std::uint32_t groups_x) { return params_of(dims, groups_x); });
}

}  // namespace

const OpRow kFeatureDistanceRow = {
    .name = "feature_distance",
    .equation =
        "y[n] = mean over pixels of sum_c weight[c] (a / (|a| + eps) - b / (|b| + eps))^2, "
        "|.| over the channels, eps = 1e-10",
    .inputs = kFeatureDistanceInputs,
    .outputs = kOutputY,
    .plan = feature_distance_plan,
    .forward = feature_distance_row_forward,
    .backward = feature_distance_row_backward};

}  // namespace splat::ops
