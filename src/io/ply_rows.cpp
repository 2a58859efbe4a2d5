#include "io/ply_rows.h"

#include <algorithm>
#include <charconv>
#include <limits>

namespace splat::io {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

std::endian order_of(PlyEncoding encoding) {
    return encoding == PlyEncoding::kBigEndian ? std::endian::big : std::endian::little;
}

/// The fewest bytes of a row: empty lists; in ascii one character and one blank for each value.
std::uint64_t least_row_bytes(const PlyElement& element, PlyEncoding encoding) {
    std::uint64_t bytes = 0;
    for (const PlyProperty& property : element.properties)
        bytes += encoding == PlyEncoding::kAscii
                     ? 2
                     : ply_type_bytes(property.list_count.value_or(property.type));
    return bytes;
}

template <class T>
Status read_as(Reader& reader, const std::string& name, double& value) {
    T raw{};
    SPLAT_TRY(reader.read(raw, name.c_str()));
    value = static_cast<double>(raw);
    return {};
}

}  // namespace

PlyRows::PlyRows(const PlyHeader& header, Bytes file)
    : encoding_(header.encoding),
      reader_(file.subspan(header.bytes), "ply data", order_of(header.encoding)),
      text_(as_text(file.subspan(header.bytes))),
      line_(header.lines + 1) {}

Status PlyRows::need(const PlyElement& element) const {
    const std::uint64_t each = least_row_bytes(element, encoding_);
    if (encoding_ != PlyEncoding::kAscii)
        return reader_.need(element.count, each, element.name.c_str());
    const auto bytes = checked_mul(element.count, each);
    if (bytes && *bytes <= text_.size() + 1) return {};  // the last line may lack its end
    return error(Code::kFormat,
                 "ply data: %llu rows of '%s' need %llu bytes each, but %zu bytes are left at line "
                 "%zu; the file is truncated or its header is damaged",
                 static_cast<unsigned long long>(element.count), element.name.c_str(),
                 static_cast<unsigned long long>(each), text_.size(), line_);
}

Status PlyRows::read(const PlyElement& element, const Row& row) {
    SPLAT_TRY(need(element));
    std::vector<double> values(element.properties.size());
    for (std::size_t i = 0; i < element.count; ++i) {
        for (std::size_t k = 0; k < values.size(); ++k) {
            const PlyProperty& property = element.properties[k];
            SPLAT_TRY(encoding_ == PlyEncoding::kAscii ? read_ascii(property, values[k])
                                                       : read_binary(property, values[k]));
        }
        row(i, values);
    }
    return {};
}

Status PlyRows::skip(const PlyElement& element) {
    if (element.properties.empty()) return {};
    return read(element, [](std::size_t, const std::vector<double>&) {});
}

Result<std::string> PlyRows::rest(bool lenient) const {
    std::uint64_t left = reader_.left();
    if (encoding_ == PlyEncoding::kAscii) {
        const std::size_t start = text_.find_first_not_of(kBlanks);
        left = start == std::string_view::npos ? 0 : text_.size() - start;
    }
    if (left == 0) return std::string();
    const std::string found = format("%llu bytes after the last row of the header's count",
                                     static_cast<unsigned long long>(left));
    if (lenient) return found;
    return error(Code::kFormat,
                 "ply data: %s, expected none: the header counts too few rows, or something was "
                 "appended to the file; a lenient reader leaves them out",
                 found.c_str());
}

Status PlyRows::read_binary(const PlyProperty& property, double& value) {
    if (!property.list_count) return read_number(property.type, property.name, value);
    SPLAT_TRY(read_number(*property.list_count, property.name, value));
    if (value < 0)
        return error(Code::kFormat, "ply data: list '%s' before byte %zu has length %.0f",
                     property.name.c_str(), reader_.position(), value);
    const auto bytes = static_cast<std::uint64_t>(value) * ply_type_bytes(property.type);
    SPLAT_ASSIGN([[maybe_unused]] const Bytes items, reader_.take(bytes, property.name.c_str()));
    return {};
}

Status PlyRows::read_number(PlyType type, const std::string& name, double& value) {
    switch (type) {
        case PlyType::kI8:
            return read_as<std::int8_t>(reader_, name, value);
        case PlyType::kU8:
            return read_as<std::uint8_t>(reader_, name, value);
        case PlyType::kI16:
            return read_as<std::int16_t>(reader_, name, value);
        case PlyType::kU16:
            return read_as<std::uint16_t>(reader_, name, value);
        case PlyType::kI32:
            return read_as<std::int32_t>(reader_, name, value);
        case PlyType::kU32:
            return read_as<std::uint32_t>(reader_, name, value);
        case PlyType::kF32:
            return read_as<float>(reader_, name, value);
        case PlyType::kF64:
            return read_as<double>(reader_, name, value);
    }
    return error(Code::kInternal, "ply: type %d", static_cast<int>(type));
}

std::string_view PlyRows::next_word() {
    const std::size_t start = std::min(text_.find_first_not_of(kBlanks), text_.size());
    line_ += static_cast<std::size_t>(std::count(text_.begin(), text_.begin() + start, '\n'));
    text_.remove_prefix(start);
    const std::size_t end = std::min(text_.find_first_of(kBlanks), text_.size());
    const std::string_view word = text_.substr(0, end);
    text_.remove_prefix(end);
    return word;
}

Status PlyRows::read_word(const std::string& name, double& value) {
    std::string_view word = next_word();
    if (word.starts_with('+')) word.remove_prefix(1);
    const char* const end = word.data() + word.size();
    const auto [stop, failed] = std::from_chars(word.data(), end, value);
    if (failed == std::errc::invalid_argument || stop != end)
        return error(Code::kFormat, "ply data: line %zu: '%s' is '%s', expected a number", line_,
                     name.c_str(), std::string(word.substr(0, 40)).c_str());
    if (failed == std::errc::result_out_of_range) {
        const bool tiny = word.find("e-") != word.npos || word.find("E-") != word.npos;
        value = tiny ? 0 : std::numeric_limits<double>::infinity();
        if (word.starts_with('-')) value = -value;
    }
    return {};
}

Status PlyRows::read_ascii(const PlyProperty& property, double& value) {
    SPLAT_TRY(read_word(property.name, value));
    if (!property.list_count) return {};
    if (!(value >= 0 && value <= static_cast<double>(text_.size())))
        return error(Code::kFormat,
                     "ply data: line %zu: list '%s' of length %g, but %zu bytes are left", line_,
                     property.name.c_str(), value, text_.size());
    double item = 0;
    for (auto left = static_cast<std::uint64_t>(value); left > 0; --left)
        SPLAT_TRY(read_word(property.name, item));
    return {};
}

}  // namespace splat::io
