#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

enum class PlyEncoding : std::uint8_t { kAscii, kLittleEndian, kBigEndian };

enum class PlyType : std::uint8_t { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

std::size_t ply_type_bytes(PlyType type);

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::kF32;
    std::optional<PlyType> list_count;  ///< the type of the count, if the property is a list
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;

    [[nodiscard]] std::optional<std::size_t> find(const std::string& property) const;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::kAscii;
    std::vector<PlyElement> elements;
    std::size_t bytes = 0;  ///< bytes of the header: the data starts here
    std::size_t lines = 0;  ///< lines of the header

    [[nodiscard]] const PlyElement* find(const std::string& element) const;
};

/// The file starts with the line "ply".
bool is_ply(Bytes file);

/// Lines end in LF or CR LF. Errors: kFormat with the line and what was expected;
/// kUnsupported above 1 MiB of header.
Result<PlyHeader> parse_ply_header(Bytes file);

}  // namespace splat::io
