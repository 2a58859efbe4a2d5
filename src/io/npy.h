#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/status.h"
#include "io/bytes.h"
#include "io/tensor_file.h"

namespace splat::io {

/// An array of float32, row-major.
struct FloatArray {
    std::vector<std::uint64_t> shape;  ///< empty: one number
    std::vector<float> values;
};

/// The header of a .npy file.
struct NpyHeader {
    std::string dtype;  ///< letter and size: "f4", "i8", "b1", "U12"
    std::endian order = std::endian::little;
    std::vector<std::uint64_t> shape;
    std::uint64_t elements = 0;
    std::size_t start = 0;      ///< byte where the numbers start
    bool column_major = false;  ///< Fortran's order
};

/// The type that a dtype's letter and size name; empty for one that tensors do not have.
inline std::optional<NumberType> npy_type(std::string_view dtype) {
    return find_number_type(&NumberTypeRow::npy, dtype);
}

/// Reads version 1 to 3. Errors: kFormat if it is damaged or truncated; kUnsupported for
/// structured types.
Result<NpyHeader> read_npy_header(Bytes file);

/// Where the numbers of a file of this header lie. Errors: as read_npy().
Result<Bytes> npy_data(Bytes file, const NpyHeader& header);

/// Version 1.0; `dtype` with its byte order, e.g. "<f4".
Buffer write_npy_header(const std::string& dtype, const std::vector<std::uint64_t>& shape);

/// A .npy file of version 1 to 3 of floats, integers or booleans of either order of bytes and of elements. float64 and
/// integers beyond 2^24 are rounded.
///
/// Errors       kFormat if it is damaged, truncated or longer than its shape; kUnsupported
///              for other types
/// Source       NumPy's documentation, numpy.lib.format
Result<FloatArray> read_npy(Bytes file);

/// Version 1.0, little-endian float32. Errors: kInvalidArgument if the shape does not fit the values.
Result<Buffer> write_npy(const FloatArray& array);

}  // namespace splat::io
