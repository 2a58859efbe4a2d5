#include "ops/strided_copy.h"

#include <algorithm>

#include "ops/launch.h"
#include "params/strided_copy_params.h"

namespace splat::ops {
namespace {

/// Parts begin at multiples of this many elements, which suits every alignment of bindings.
constexpr std::uint64_t kPartAlignment = 256;
/// Floats that one dispatch takes, so that 32 bits index them.
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
                     static_cast<unsigned long long>(view.bytes),
                     static_cast<unsigned long long>(last * 4));
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

}  // namespace

Status strided_copy(vk::Recorder& recorder, const StridedCopyDesc& desc, const vk::BufferView& x,
                    const vk::BufferView& y) {
    if (desc.count == 0) return {};
    SPLAT_TRY(check("x", desc, desc.in, x));
    SPLAT_TRY(check("y", desc, desc.out, y));
    const std::uint64_t stride = std::max(desc.in.stride, desc.out.stride);
    const std::uint64_t floats =
        std::min(recorder.device().limits.max_storage_buffer_bytes / 4, kMostFloats);
    const std::uint64_t most = floats / stride / kPartAlignment * kPartAlignment;
    if (most == 0)
        return error(Code::kUnsupported, "strided_copy: a stride of %llu floats is too long",
                     static_cast<unsigned long long>(stride));
    const std::uint32_t size = workgroup_size(recorder.device(), 64);
    for (std::uint64_t first = 0; first < desc.count; first += most) {
        const std::uint64_t count = std::min(most, desc.count - first);
        const vk::Groups groups = groups_for(recorder.device(), count * desc.channels, size);
        const params::StridedCopyParams params{static_cast<std::uint32_t>(count),
                                               desc.channels,
                                               desc.in.stride,
                                               desc.in.offset,
                                               desc.out.stride,
                                               desc.out.offset,
                                               desc.accumulate ? 1U : 0U,
                                               groups[0]};
        SPLAT_TRY(recorder.dispatch({
            .op = "strided_copy",
            .shader = "strided_copy",
            .constants = {{kWorkgroupSizeId, size}},
            .push = params,
            .accesses = {vk::read(part_of(x, desc.in, first, count)),
                         vk::read_write(part_of(y, desc.out, first, count))},
            .groups = groups,
            .work = {.flops = 0,
                     .bytes = (desc.accumulate ? 12.0 : 8.0) * static_cast<double>(count) *
                              desc.channels},
        }));
    }
    return {};
}

}  // namespace splat::ops
