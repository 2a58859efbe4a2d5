#include "core/shape.h"

#include <algorithm>

#include "core/checked_math.h"
#include "core/shown.h"

namespace splat {

Shape::Shape(std::initializer_list<std::uint32_t> dims)
    : rank_(static_cast<std::uint32_t>(dims.size())) {
    SPLAT_ASSERT(dims.size() <= kMaxRank);
    std::ranges::copy(dims, dims_.begin());
}

Result<Shape> Shape::create(std::span<const std::int64_t> dims, const std::string& what) {
    if (dims.size() > kMaxRank)
        return invalid("%s: rank is %zu, expected at most %u", what.c_str(), dims.size(), kMaxRank);
    Shape shape;
    std::uint64_t elements = 1;
    for (const std::int64_t dim : dims) {
        if (dim < 1)
            return invalid("%s: dims[%u] is %lld, expected at least 1", what.c_str(), shape.rank_,
                           lld(dim));
        const auto product = checked_mul(elements, static_cast<std::uint64_t>(dim));
        if (!product || *product > kMaxElements)
            return invalid(
                "%s: more than 2^31 - 1 elements up to dims[%u] = %lld; split the tensor "
                "along an outer dimension",
                what.c_str(), shape.rank_, lld(dim));
        elements = *product;
        shape.dims_[shape.rank_++] = static_cast<std::uint32_t>(dim);
    }
    return shape;
}

std::uint64_t Shape::elements() const {
    std::uint64_t product = 1;
    for (std::uint32_t axis = 0; axis < rank_; ++axis) product *= dims_[axis];
    return product;
}

std::string Shape::text() const {
    const auto text_of = [](std::uint32_t dim) { return std::to_string(dim); };
    return "[" + joined(std::span(dims_).first(rank_), text_of) + "]";
}

}  // namespace splat
