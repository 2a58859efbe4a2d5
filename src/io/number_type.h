#pragma once

#include <optional>

#include "io/bytes.h"

namespace splat::io {

/// Type of numbers in a file.
enum class NumberType : std::uint8_t {
    kF32,
    kF64,
    kF16,
    kBf16,
    kI64,
    kI32,
    kI16,
    kI8,
    kU8,
    kBool,
    kU16,
    kU32,
    kU64
};

/// A type, and the names that formats give it; null where a format has none.
struct NumberTypeRow {
    const char* name;  ///< PyTorch's name: "float32", "bfloat16", "bool"
    std::size_t bytes;
    const char* safetensors;
    const char* npy;  ///< letter and size of a dtype, "f4"
    void (*to_floats)(Bytes bytes, float* values, std::endian order);
    double (*to_double)(const std::byte* at, std::endian order);
};

const NumberTypeRow& number_type_row(NumberType type);

/// The type of this name in a column of the rows.
std::optional<NumberType> find_number_type(const char* NumberTypeRow::*column,
                                           std::string_view name);

inline const char* type_name(NumberType type) {
    return number_type_row(type).name;
}

inline std::size_t type_bytes(NumberType type) {
    return number_type_row(type).bytes;
}

/// Numbers of a file as float32, exact where float32 can be. `bytes` holds type_bytes() for each.
void to_floats(NumberType type, Bytes bytes, float* values,
               std::endian order = std::endian::little);

/// The nearest number of type float16, ties to even; beyond 65519 infinity.
std::uint16_t to_half(float value);

/// The number of a float16, exactly.
float from_half(std::uint16_t half);

}  // namespace splat::io
