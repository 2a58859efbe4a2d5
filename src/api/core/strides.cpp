#include "api/core/strides.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>

#include "core/checked_math.h"

namespace splat::api {
namespace {

constexpr std::size_t kElementBytes = 4;

/// Elements are distinct if, sorted by stride, each dimension steps over the span of the smaller
/// ones. This is sufficient, and true of every permuted or padded layout.
bool is_distinct(const Shape& shape, std::span<const std::int64_t> strides) {
    std::vector<std::uint32_t> order(shape.rank());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::sort(order, [&](auto a, auto b) { return strides[a] < strides[b]; });
    std::int64_t last = 0;  // place of the last element in the dimensions so far
    for (const std::uint32_t axis : order) {
        if (shape[axis] == 1) continue;
        if (strides[axis] <= last) return false;
        last += strides[axis] * (shape[axis] - 1);
    }
    return true;
}

/// Calls visit(place in strided memory, row-major index) for every element.
template <class Visit>
void for_each(const Shape& shape, const HostLayout& layout, Visit&& visit) {
    std::array<std::uint32_t, kMaxRank> at{};
    std::size_t place = 0;
    const std::uint64_t elements = shape.elements();
    for (std::uint64_t i = 0; i < elements; ++i) {
        visit(place, i);
        for (std::uint32_t axis = shape.rank(); axis-- > 0;) {
            const auto stride = static_cast<std::size_t>(layout.strides[axis]);
            place += stride;
            if (++at[axis] < shape[axis]) break;
            place -= stride * shape[axis];
            at[axis] = 0;
        }
    }
}

}  // namespace

Result<HostLayout> host_layout(const Shape& shape, const std::int64_t* strides, std::size_t bytes,
                               bool distinct) {
    HostLayout layout;
    layout.strides.resize(shape.rank());
    std::int64_t step = 1;
    layout.contiguous = true;
    for (std::uint32_t axis = shape.rank(); axis-- > 0;) {
        layout.strides[axis] = strides != nullptr ? strides[axis] : step;
        if (shape[axis] > 1 && layout.strides[axis] != step) layout.contiguous = false;
        step *= shape[axis];
    }
    std::uint64_t last = 0;  // place of the farthest element
    for (std::uint32_t axis = 0; axis < shape.rank(); ++axis) {
        if (layout.strides[axis] < 0)
            return invalid("strides[%u] is %lld, expected at least 0", axis,
                           lld(layout.strides[axis]));
        const auto reach =
            checked_mul(static_cast<std::uint64_t>(layout.strides[axis]), shape[axis] - 1);
        const auto sum = reach ? checked_add(last, *reach) : reach;
        if (!sum || *sum > SIZE_MAX / kElementBytes - 1)
            return invalid("strides[%u] = %lld reaches beyond the address space", axis,
                           lld(layout.strides[axis]));
        last = *sum;
    }
    if ((last + 1) * kElementBytes > bytes)
        return invalid("bytes is %zu, but a tensor of shape %s with these strides takes %llu",
                       bytes, shape.text().c_str(), llu((last + 1) * kElementBytes));
    if (distinct && !is_distinct(shape, layout.strides))
        return invalid("the strides put two elements of a tensor of shape %s in one place",
                       shape.text().c_str());
    return layout;
}

void gather(const Shape& shape, const HostLayout& layout, const std::byte* strided,
            std::byte* contiguous) {
    for_each(shape, layout, [&](std::size_t place, std::uint64_t i) {
        std::memcpy(contiguous + i * kElementBytes, strided + place * kElementBytes, kElementBytes);
    });
}

void scatter(const Shape& shape, const HostLayout& layout, const std::byte* contiguous,
             std::byte* strided) {
    for_each(shape, layout, [&](std::size_t place, std::uint64_t i) {
        std::memcpy(strided + place * kElementBytes, contiguous + i * kElementBytes, kElementBytes);
    });
}

}  // namespace splat::api
