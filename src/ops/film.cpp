#include "ops/film.h"

#include "params/film_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

/// A kernel with one invocation per quad of x.
Status record(vk::Recorder& recorder, const char* kernel, const FilmDesc& desc,
              std::vector<vk::Access> accesses) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), desc.x.quads(), size);
    const double bytes = static_cast<double>(desc.x.bytes());
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::FilmParams{desc.x.n, desc.x.c, desc.x.p, desc.scaled ? 0U : 1U, groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = bytes / 2, .bytes = 2 * bytes},
        .may_alias = true,
    });
}

}  // namespace

Status film_check(const vk::DeviceInfo& device, const FilmDesc& desc) {
    if ((desc.x.c + 3) / 4 > device.limits.max_groups[0] || desc.x.n > device.limits.max_groups[1])
        return error(Code::kUnsupported,
                     "film: %u channels in batch %u, but the device takes at most %u quads of "
                     "channels and %u images",
                     desc.x.c, desc.x.n, device.limits.max_groups[0], device.limits.max_groups[1]);
    return {};
}

Status film_forward(vk::Recorder& recorder, const FilmDesc& desc, const vk::BufferView& x,
                    const vk::BufferView& modulation, const vk::BufferView& y) {
    SPLAT_TRY(film_check(recorder.device(), desc));
    return record(recorder, "film_forward", desc,
                  {vk::read(x), vk::read(modulation), vk::write(y)});
}

Status film_backward_input(vk::Recorder& recorder, const FilmDesc& desc,
                           const vk::BufferView& modulation, const vk::BufferView& grad_y,
                           const vk::BufferView& grad_x) {
    SPLAT_TRY(film_check(recorder.device(), desc));
    return record(recorder, "film_backward_input", desc,
                  {vk::read(modulation), vk::read(grad_y), vk::write(grad_x)});
}

Status film_backward_modulation(vk::Recorder& recorder, const FilmDesc& desc,
                                const vk::BufferView& x, const vk::BufferView& grad_y,
                                const vk::BufferView& grad_modulation) {
    SPLAT_TRY(film_check(recorder.device(), desc));
    // One subgroup on CPU devices, as in group_norm.cpp.
    const std::uint32_t lanes = recorder.kernels() == vk::Kernels::kCpu ? 8 : 64;
    const double bytes = static_cast<double>(desc.x.bytes());
    return recorder.dispatch({
        .op = "film_backward_modulation",
        .shader = "film_backward_modulation",
        .constants = {{params::kWorkgroupSizeId,
                       vk::workgroup_size(recorder.device(), lanes, desc.x.p)}},
        .push = params::FilmParams{desc.x.n, desc.x.c, desc.x.p, desc.scaled ? 0U : 1U, 0},
        .accesses = {vk::read(x), vk::read(grad_y), vk::write(grad_modulation)},
        .groups = {(desc.x.c + 3) / 4, desc.x.n, 1},
        .work = {.flops = bytes, .bytes = 2 * bytes},
    });
}

}  // namespace splat::ops
