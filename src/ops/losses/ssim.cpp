#include "ops/losses/ssim.h"

#include "params/ssim_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

constexpr std::uint64_t kForwardPlanes = 5;  // a, b, a^2, b^2, a b
constexpr std::uint64_t kSlopes = 3;         // by the moments of a, a^2, a b
constexpr double kTaps = 11;

struct Pass {
    const char* kernel;
    std::vector<vk::Access> accesses;
    double planes;     ///< that the window goes over
    bool sum = false;  ///< a workgroup per chunk, not an invocation per quad
};

Status record(vk::Recorder& recorder, const SsimDesc& desc, Pass pass) {
    const QuadDims dims = desc.quads();
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = pass.sum ? vk::groups_for(recorder.device(), loss_chunks(dims), 1)
                                       : vk::groups_for(recorder.device(), dims.quads(), size);
    const double bytes = static_cast<double>(dims.bytes());
    return recorder.dispatch({
        .op = pass.kernel,
        .shader = pass.kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::SsimParams{desc.n, desc.c, desc.height, desc.width,
                                   static_cast<std::uint32_t>(dims.quads()), kLossChunk,
                                   loss_scale(dims), groups[0]},
        .accesses = std::move(pass.accesses),
        .groups = groups,
        .work = {.flops = kTaps * pass.planes * bytes / 2, .bytes = 2 * pass.planes * bytes},
    });
}

}  // namespace

std::uint64_t ssim_slopes_bytes(const SsimDesc& desc) {
    return kSlopes * desc.quads().bytes();
}

std::uint64_t ssim_forward_rows_bytes(const SsimDesc& desc) {
    return kForwardPlanes * desc.quads().bytes();
}

std::uint64_t ssim_backward_rows_bytes(const SsimDesc& desc) {
    return kSlopes * desc.quads().bytes();
}

Status ssim_forward(vk::Recorder& recorder, const SsimDesc& desc, const vk::BufferView& a,
                    const vk::BufferView& b, const vk::BufferView& rows,
                    const vk::BufferView& slopes, const vk::BufferView& partial,
                    const vk::BufferView& loss) {
    SPLAT_TRY(
        record(recorder, desc,
               {"ssim_forward_rows", {vk::read(a), vk::read(b), vk::write(rows)}, kForwardPlanes}));
    SPLAT_TRY(record(recorder, desc,
                     {"ssim_forward",
                      {vk::read(rows), vk::write(slopes), vk::write(partial)},
                      kForwardPlanes,
                      true}));
    return loss_sum(recorder, desc.quads(), partial, loss);
}

Status ssim_backward(vk::Recorder& recorder, const SsimDesc& desc, const vk::BufferView& a,
                     const vk::BufferView& b, const vk::BufferView& slopes,
                     const vk::BufferView& rows, const vk::BufferView& grad_loss,
                     const vk::BufferView& grad_a) {
    SPLAT_TRY(record(recorder, desc,
                     {"ssim_backward_rows", {vk::read(slopes), vk::write(rows)}, kSlopes}));
    return record(
        recorder, desc,
        {"ssim_backward",
         {vk::read(a), vk::read(b), vk::read(rows), vk::read(grad_loss), vk::write(grad_a)},
         kSlopes});
}

}  // namespace splat::ops
