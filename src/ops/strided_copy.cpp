#include "ops/strided_copy.h"

#include <algorithm>

#include "params/strided_copy_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

/// Parts begin at multiples of this many elements, which satisfies every alignment of bindings.
constexpr std::uint64_t kPartAlignment = 256;
/// Floats per dispatch, so that 32 bits index them.
constexpr std::uint64_t kMostFloats = std::uint64_t{1} << 30;

Status check(const char* name, const StridedCopyDesc& desc, const Stride& layout,
             const vk::BufferView& view) {
    if (desc.channels == 0 || layout.offset + std::uint64_t{desc.channels} > layout.stride)
        return error(Code::kShape,
                     "strided_copy: %u floats from %u on do not fit the stride %u of %s",
                     desc.channels, layout.offset, layout.stride, name);
    const std::uint64_t last = (desc.count - 1) * layout.stride + layout.offset + desc.channels;
    if (last * 4 > view.bytes)
        return error(Code::kShape, "strided_copy: %s has %llu bytes, expected at least %llu", name,
                     llu(view.bytes), llu(last * 4));
    return {};
}

vk::BufferView part_of(const vk::BufferView& view, const Stride& layout, std::uint64_t first,
                       std::uint64_t count) {
    vk::BufferView part = view;
    const std::uint64_t skipped = first * layout.stride * 4;
    part.offset += skipped;
    part.bytes = std::min(vk::quad_bytes(count * layout.stride), view.bytes - skipped);
    part.shape = {static_cast<std::uint32_t>(part.bytes / 4)};
    return part;
}

/// Elements that fit a binding: x and y begin with the first of them.
struct Part {
    vk::BufferView x;
    vk::BufferView y;
};

/// Elements begin to end - 1 of `part`; `dense`: a multiple of 4 of them from 0 on, to a y without
/// gaps.
Status copy_part(vk::Recorder& recorder, const StridedCopyDesc& desc, const Part& part,
                 std::uint64_t begin, std::uint64_t end, bool dense) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const std::uint64_t floats = (end - begin) * desc.channels;
    const vk::Groups groups = vk::groups_for(recorder.device(), dense ? floats / 4 : floats, size);
    const params::StridedCopyParams params{.begin = static_cast<std::uint32_t>(begin),
                                           .count = static_cast<std::uint32_t>(end),
                                           .in_stride = desc.in.stride,
                                           .in_offset = desc.in.offset,
                                           .out_stride = desc.out.stride,
                                           .out_offset = desc.out.offset,
                                           .groups_x = groups[0]};
    return recorder.dispatch({
        .op = "strided_copy",
        .shader = dense ? "strided_copy_dense" : "strided_copy",
        .constants = {{params::kWorkgroupSizeId, size},
                      {params::kStridedCopyChannelsId, desc.channels},
                      {params::kStridedCopyAccumulateId, desc.accumulate ? 1U : 0U}},
        .push = params,
        .accesses = {vk::read(part.x), vk::read_write(part.y)},
        .groups = groups,
        .work = {.flops = 0, .bytes = (desc.accumulate ? 12.0 : 8.0) * static_cast<double>(floats)},
    });
}

}  // namespace

Status strided_copy(vk::Recorder& recorder, const StridedCopyDesc& desc, const vk::BufferView& x,
                    const vk::BufferView& y) {
    if (desc.count == 0) return {};
    SPLAT_TRY(check("x", desc, desc.in, x));
    SPLAT_TRY(check("y", desc, desc.out, y));
    const std::uint64_t stride = std::max(desc.in.stride, desc.out.stride);
    const vk::DeviceLimits& limits = recorder.device().limits;
    std::uint64_t floats = std::min(limits.max_storage_buffer_bytes / 4, kMostFloats);
    if (recorder.kernels() == vk::Kernels::kCpu)
        floats = std::min(floats, limits.max_texel_elements);
    const std::uint64_t most = floats / stride / kPartAlignment * kPartAlignment;
    if (most == 0)
        return unsupported("strided_copy: a stride of %llu floats is too long", llu(stride));
    const bool dense = desc.out.stride == desc.channels;
    for (std::uint64_t first = 0; first < desc.count; first += most) {
        const std::uint64_t count = std::min(most, desc.count - first);
        const std::uint64_t whole = dense ? count / 4 * 4 : 0;
        const Part part{part_of(x, desc.in, first, count), part_of(y, desc.out, first, count)};
        if (whole > 0) SPLAT_TRY(copy_part(recorder, desc, part, 0, whole, true));
        if (whole < count) SPLAT_TRY(copy_part(recorder, desc, part, whole, count, false));
    }
    return {};
}

}  // namespace splat::ops
