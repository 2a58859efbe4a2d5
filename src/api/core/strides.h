#pragma once

#include <cstddef>
#include <vector>

#include "core/shape.h"

namespace splat::api {

/// Layout of a tensor in the caller's memory: one stride per dimension, in elements.
struct HostLayout {
    std::vector<std::int64_t> strides;
    bool contiguous = false;  ///< row-major without gaps
};

/// Check the caller's strides (NULL = contiguous) against the bytes given.
/// Errors: kInvalidArgument for a negative stride, for elements outside `bytes`, and, where
/// `distinct`, if two elements share a place.
Result<HostLayout> host_layout(const Shape& shape, const std::int64_t* strides, std::size_t bytes,
                               bool distinct);

/// Copy 4-byte elements between strided and contiguous memory.
void gather(const Shape& shape, const HostLayout& layout, const std::byte* strided,
            std::byte* contiguous);
void scatter(const Shape& shape, const HostLayout& layout, const std::byte* contiguous,
             std::byte* strided);

}  // namespace splat::api
