#include "ops/concat.h"

#include "core/checked_math.h"
#include "params/concat_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

using vk::BufferView;

std::uint64_t bytes_of(const ConcatDesc& desc, std::uint32_t channels) {
    return std::uint64_t{(channels + 3) / 4} * desc.columns * 16;
}

Status check(const ConcatDesc& desc) {
    const auto elements = checked_mul(desc.columns, round_up(std::uint64_t{desc.a} + desc.b, 4));
    if (!elements || *elements > kMaxElements)
        return error(Code::kUnsupported,
                     "concat: %u and %u channels of %u pixels have 2^31 elements or more", desc.a,
                     desc.b, desc.columns);
    return {};
}

Status record(vk::Recorder& recorder, const char* kernel, const ConcatDesc& desc,
              std::uint32_t offset, std::uint32_t count, std::vector<vk::Access> accesses) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const std::uint64_t bytes = bytes_of(desc, count);
    const vk::Groups groups = vk::groups_for(recorder.device(), bytes / 16, size);
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::ConcatParams{desc.columns, desc.a, desc.b, offset, count, groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 0, .bytes = 2 * static_cast<double>(bytes)},
    });
}

}  // namespace

Status concat_forward(vk::Recorder& recorder, const ConcatDesc& desc, const BufferView& a,
                      const BufferView& b, const BufferView& y) {
    SPLAT_TRY(check(desc));
    if (desc.a % 4 != 0)
        return record(recorder, "concat_forward", desc, 0, desc.a + desc.b,
                      {vk::read(a), vk::read(b), vk::write(y)});
    const std::uint64_t bytes_a = bytes_of(desc, desc.a);
    const std::uint64_t bytes_b = bytes_of(desc, desc.b);
    SPLAT_TRY(recorder.copy(a.part(0, bytes_a), y.part(0, bytes_a)));
    return recorder.copy(b.part(0, bytes_b), y.part(bytes_a, bytes_b));
}

Status concat_backward(vk::Recorder& recorder, const ConcatDesc& desc, const BufferView& grad_y,
                       const BufferView& grad_a, const BufferView& grad_b) {
    SPLAT_TRY(check(desc));
    const auto take = [&](std::uint32_t offset, std::uint32_t count,
                          const BufferView& to) -> Status {
        if (to.block == nullptr) return {};
        if (desc.a % 4 == 0) {
            const std::uint64_t bytes = bytes_of(desc, count);
            return recorder.copy(grad_y.part(bytes_of(desc, offset), bytes), to.part(0, bytes));
        }
        return record(recorder, "concat_backward", desc, offset, count,
                      {vk::read(grad_y), vk::write(to)});
    };
    SPLAT_TRY(take(0, desc.a, grad_a));
    return take(desc.a, desc.b, grad_b);
}

}  // namespace splat::ops
