#pragma once

#include <cstdint>

#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

/// An array of float32, row-major.
struct FloatArray {
    std::vector<std::uint64_t> shape;  ///< empty: one number
    std::vector<float> values;
};

/// A .npy file of version 1 to 3 of dtype f4 of either byte order, or f8, which is rounded.
///
/// Errors       kInvalidArgument if it is damaged, truncated or longer than its shape; kUnsupported
///              for other types and for column-major arrays
/// Source       NumPy's documentation, numpy.lib.format
Result<FloatArray> read_npy(Bytes file);

/// Version 1.0, little-endian float32. Errors: kInvalidArgument if the shape does not fit the values.
Result<Buffer> write_npy(const FloatArray& array);

}  // namespace splat::io
