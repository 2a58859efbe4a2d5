#include "ops/resample2d.h"

#include <algorithm>

#include "core/checked_math.h"
#include "params/resample2d_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

constexpr std::uint32_t kMaxTaps = 16;

/// One dispatch from an image of height x width.
Status record(vk::Recorder& recorder, const char* kernel, const Resample2dDesc& desc, bool up,
              std::uint32_t height, std::uint32_t width, std::vector<vk::Access> accesses) {
    params::Resample2dParams params{};
    params.planes = (desc.c + 3) / 4 * desc.n;
    params.height = height;
    params.width = width;
    params.taps = desc.taps;
    params.gain = desc.up ? 4.0F : 1.0F;
    const std::uint64_t in = std::uint64_t{params.planes} * height * width;
    const std::uint64_t out = up ? 4 * in : in / 4;
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), out, size);
    params.groups_x = groups[0];
    const double taps = std::max(2U, desc.taps);
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size},
                      {params::kResample2dBoxId, desc.taps == 0 ? 1U : 0U},
                      {params::kResample2dUpId, up ? 1U : 0U}},
        .push = params,
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 8.0 * taps * taps * static_cast<double>(std::min(in, out)),
                 .bytes = 16.0 * static_cast<double>(in + out)},
    });
}

}  // namespace

Status resample2d_check(const Resample2dDesc& desc) {
    if (!desc.up && (desc.height % 2 != 0 || desc.width % 2 != 0))
        return error(Code::kShape,
                     "resample2d: an image of %u x %u does not halve; expected even sizes",
                     desc.height, desc.width);
    if (desc.taps % 2 != 0 || desc.taps > kMaxTaps)
        return error(Code::kInvalidArgument,
                     "resample2d: a filter of %u taps, expected an even number up to %u", desc.taps,
                     kMaxTaps);
    const auto pixels = checked_mul(std::uint64_t{desc.height} * desc.width,
                                    round_up(desc.c, 4) * desc.n * (desc.up ? 4U : 1U));
    if (!pixels || *pixels > kMaxElements)
        return error(Code::kUnsupported,
                     "resample2d: [%u, %u, %u, %u] or its result has 2^31 elements or more", desc.n,
                     desc.c, desc.height, desc.width);
    return {};
}

Status resample2d_forward(vk::Recorder& recorder, const Resample2dDesc& desc,
                          const vk::BufferView& x, const vk::BufferView& filter,
                          const vk::BufferView& y) {
    SPLAT_TRY(resample2d_check(desc));
    return record(recorder, "resample2d_forward", desc, desc.up, desc.height, desc.width,
                  {vk::read(x), vk::read(filter), vk::write(y)});
}

Status resample2d_backward(vk::Recorder& recorder, const Resample2dDesc& desc,
                           const vk::BufferView& filter, const vk::BufferView& grad_y,
                           const vk::BufferView& grad_x) {
    SPLAT_TRY(resample2d_check(desc));
    const auto other = [&](std::uint32_t size) { return desc.up ? 2 * size : size / 2; };
    return record(recorder, "resample2d_backward", desc, !desc.up, other(desc.height),
                  other(desc.width), {vk::read(grad_y), vk::read(filter), vk::write(grad_x)});
}

}  // namespace splat::ops
