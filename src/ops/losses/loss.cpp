#include "ops/losses/loss.h"

#include "core/checked_math.h"
#include "params/loss_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

params::LossParams loss_params(const QuadDims& dims, std::uint32_t groups_x) {
    return {static_cast<std::uint32_t>(dims.quads()), kLossChunk, loss_chunks(dims),
            loss_scale(dims), groups_x};
}

}  // namespace

std::uint32_t loss_chunks(const QuadDims& dims) {
    return static_cast<std::uint32_t>(ceil_div(dims.quads(), kLossChunk));
}

std::uint64_t loss_partial_bytes(const QuadDims& dims) {
    return vk::quad_bytes(loss_chunks(dims));
}

float loss_scale(const QuadDims& dims) {
    return static_cast<float>(1.0 / (static_cast<double>(dims.n) * dims.c * dims.p));
}

Status loss_sum(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& partial,
                const vk::BufferView& loss) {
    const double sums = loss_chunks(dims);
    return recorder.dispatch({
        .op = "loss_sum",
        .shader = "loss_sum",
        .constants = {{params::kWorkgroupSizeId, vk::workgroup_size(recorder.device(), 64)}},
        .push = loss_params(dims, 1),
        .accesses = {vk::read(partial), vk::write(loss)},
        .groups = {1, 1, 1},
        .work = {.flops = sums, .bytes = 4 * sums},
    });
}

Status pixel_loss_forward(vk::Recorder& recorder, const char* kernel, const OpViews& v) {
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(v.inputs[0].shape));
    const vk::BufferView partial = v.workspace.part(0, loss_partial_bytes(dims));
    const vk::Groups groups = vk::groups_for(recorder.device(), loss_chunks(dims), 1);
    const double bytes = static_cast<double>(dims.bytes());
    SPLAT_TRY(recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, vk::workgroup_size(recorder.device(), 64)}},
        .push = loss_params(dims, groups[0]),
        .accesses = {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::write(partial)},
        .groups = groups,
        .work = {.flops = 0.75 * bytes, .bytes = 2 * bytes},
    }));
    return loss_sum(recorder, dims, partial, v.outputs[0]);
}

Status pixel_loss_backward(vk::Recorder& recorder, const char* kernel, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(v.inputs[0].shape));
    const double bytes = static_cast<double>(dims.bytes());
    return record_each(recorder,
                       {.kernel = kernel,
                        .items = dims.quads(),
                        .accesses = {vk::read(v.inputs[0]), vk::read(v.inputs[1]),
                                     vk::read(v.grad_outputs[0]), vk::write(v.grad_inputs[0])},
                        .work = {.flops = 0.75 * bytes, .bytes = 3 * bytes}},
                       [&](std::uint32_t groups_x) { return loss_params(dims, groups_x); });
}

Result<OpPlan> loss_plan(const char* op, std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(inputs[0]));
    SPLAT_TRY(expect_shape(op, "b", inputs[1], inputs[0]));
    return OpPlan{.outputs = {Shape{1}}, .forward_workspace = loss_partial_bytes(dims)};
}

}  // namespace splat::ops
