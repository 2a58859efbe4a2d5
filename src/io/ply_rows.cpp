#include "io/ply_rows.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <utility>

#include "core/shown.h"
#include "io/scene_load.h"

namespace splat::io {
namespace {

constexpr std::size_t kMaxHeaderBytes = 1U << 20;
constexpr std::size_t kMaxPlyElements = 64;
constexpr std::size_t kMaxProperties = 1024;

constexpr std::pair<std::string_view, NumberType> kTypeNames[] = {
    {"char", NumberType::kI8},    {"int8", NumberType::kI8},     {"uchar", NumberType::kU8},
    {"uint8", NumberType::kU8},   {"short", NumberType::kI16},   {"int16", NumberType::kI16},
    {"ushort", NumberType::kU16}, {"uint16", NumberType::kU16},  {"int", NumberType::kI32},
    {"int32", NumberType::kI32},  {"uint", NumberType::kU32},    {"uint32", NumberType::kU32},
    {"float", NumberType::kF32},  {"float32", NumberType::kF32}, {"double", NumberType::kF64},
    {"float64", NumberType::kF64}};

/// The first whole lines of a file, as many as a header may have.
Bytes first_lines(Bytes file) {
    const std::string_view head = as_text(file).substr(0, kMaxHeaderBytes);
    return file.first(head.rfind('\n') + 1);  // 0 without a line
}

class HeaderParser {
  public:
    explicit HeaderParser(Bytes file) : file_(file), lines_(first_lines(file), "ply: header") {}

    Result<PlyHeader> parse() {
        SPLAT_TRY(next_line());  // "ply"
        while (true) {
            SPLAT_TRY(next_line());
            if (words_.empty() || words_[0] == "obj_info") continue;
            if (words_[0] == "comment") {
                if (words_.size() > 1)
                    header_.comments.emplace_back(words_[1].begin(), words_.back().end());
                continue;
            }
            if (words_[0] == "end_header") break;
            if (words_[0] == "format") {
                SPLAT_TRY(format_line());
            } else if (words_[0] == "element") {
                SPLAT_TRY(element_line());
            } else if (words_[0] == "property") {
                SPLAT_TRY(property_line());
            } else {
                return bad(quoted(words_[0]) +
                           ", expected format, element, property, comment or end_header");
            }
        }
        if (!has_format_) return bad("there is no 'format' line");
        header_.bytes = lines_.position();
        header_.lines = lines_.number();
        return std::move(header_);
    }

  private:
    [[nodiscard]] Status bad(const std::string& problem) const { return lines_.bad(problem); }

    static std::string quoted(std::string_view word) { return "'" + shown(word, 40) + "'"; }

    Status next_line() {
        std::string_view line;
        if (!lines_.next(line)) {
            if (file_.size() > kMaxHeaderBytes)
                return unsupported("ply: more than %zu bytes of header", kMaxHeaderBytes);
            return damaged("ply: header line %zu: the header ends without 'end_header'",
                           lines_.number() + 1);
        }
        words_.clear();
        for (Words rest(line, lines_); !rest.done();) {
            SPLAT_ASSIGN(const std::string_view word, rest.word("word"));
            words_.push_back(word);
        }
        return {};
    }

    Status format_line() {
        constexpr std::pair<std::string_view, PlyEncoding> kEncodings[] = {
            {"ascii", PlyEncoding::kAscii},
            {"binary_little_endian", PlyEncoding::kLittleEndian},
            {"binary_big_endian", PlyEncoding::kBigEndian}};
        if (words_.size() != 3 || words_[2] != "1.0")
            return bad("expected 'format <encoding> 1.0'");
        for (const auto& [name, encoding] : kEncodings)
            if (words_[1] == name) {
                header_.encoding = encoding;
                has_format_ = true;
                return {};
            }
        return bad("encoding " + quoted(words_[1]) +
                   ", expected ascii, binary_little_endian or binary_big_endian");
    }

    Status element_line() {
        PlyElement element;
        if (words_.size() != 3) return bad("expected 'element <name> <count>'");
        const auto count = number_in<std::uint64_t>(words_[2]);
        if (!count) return bad("count " + quoted(words_[2]) + " is not a whole number >= 0");
        element.count = *count;
        element.name = words_[1];
        if (header_.find(element.name) != nullptr)
            return bad("a second element '" + element.name + "'");
        if (header_.elements.size() == kMaxPlyElements) return bad("too many elements");
        header_.elements.push_back(std::move(element));
        return {};
    }

    Status property_line() {
        if (header_.elements.empty()) return bad("a property before the first element");
        PlyElement& element = header_.elements.back();
        PlyProperty property;
        const bool list = words_.size() == 5 && words_[1] == "list";
        if (!list && words_.size() != 3)
            return bad(
                "expected 'property <type> <name>' or 'property list <count type> <type> "
                "<name>'");
        if (list) {
            SPLAT_ASSIGN(property.list_count, type_of(words_[2]));
            if (*property.list_count == NumberType::kF32 ||
                *property.list_count == NumberType::kF64)
                return bad("a list count that is not an integer");
        }
        SPLAT_ASSIGN(property.type, type_of(words_[list ? 3 : 1]));
        property.name = words_.back();
        if (element.find(property.name))
            return bad("a second property '" + property.name + "' of " + element.name);
        if (element.properties.size() == kMaxProperties) return bad("too many properties");
        element.properties.push_back(std::move(property));
        return {};
    }

    Result<NumberType> type_of(std::string_view word) const {
        for (const auto& [name, type] : kTypeNames)
            if (name == word) return type;
        return bad("type " + quoted(word) + ", expected one such as float or uchar");
    }

    Bytes file_;
    Lines lines_;
    std::vector<std::string_view> words_;
    PlyHeader header_;
    bool has_format_ = false;
};

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
                     : type_bytes(property.list_count.value_or(property.type));
    return bytes;
}

}  // namespace

std::optional<std::size_t> PlyElement::find(const std::string& property) const {
    for (std::size_t i = 0; i < properties.size(); ++i)
        if (properties[i].name == property) return i;
    return std::nullopt;
}

const PlyElement* PlyHeader::find(const std::string& element) const {
    for (const PlyElement& candidate : elements)
        if (candidate.name == element) return &candidate;
    return nullptr;
}

bool is_ply(Bytes file) {
    const std::string_view text = as_text(file);
    return text.starts_with("ply\n") || text.starts_with("ply\r\n");
}

Result<PlyHeader> parse_ply_header(Bytes file) {
    if (!is_ply(file)) return damaged("ply: the first line is not 'ply'");
    return HeaderParser(file).parse();
}

PlyRows::PlyRows(const PlyHeader& header, Bytes file, bool discard)
    : encoding_(header.encoding),
      reader_(file.subspan(header.bytes), "ply data", order_of(header.encoding)),
      text_(as_text(file.subspan(header.bytes))),
      line_(header.lines + 1),
      discard_(discard) {}

Status PlyRows::need(const PlyElement& element) const {
    const std::uint64_t each = least_row_bytes(element, encoding_);
    if (encoding_ != PlyEncoding::kAscii)
        return reader_.need(element.count, each, element.name.c_str());
    const auto bytes = checked_mul(element.count, each);
    if (bytes && *bytes <= text_.size() + 1) return {};  // the last line may lack its end
    return damaged(
        "ply data: %llu rows of '%s' need %llu bytes each, but %zu bytes are left at line "
        "%zu; the file is truncated or its header is damaged",
        llu(element.count), element.name.c_str(), llu(each), text_.size(), line_);
}

Status PlyRows::read(const PlyElement& element, const Row& row) {
    SPLAT_TRY(need(element));
    const bool lists = std::ranges::any_of(
        element.properties, [](const PlyProperty& p) { return p.list_count.has_value(); });
    if (encoding_ != PlyEncoding::kAscii && !lists) return read_fixed(element, row);
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

/// Rows of one length: a scene of 10 million Gaussians has 170 million numbers.
Status PlyRows::read_fixed(const PlyElement& element, const Row& row) {
    struct Column {
        std::size_t at;
        double (*to_double)(const std::byte* at, std::endian order);
    };
    std::vector<Column> columns;
    std::size_t stride = 0;
    for (const PlyProperty& property : element.properties) {
        columns.push_back({stride, number_type_row(property.type).to_double});
        stride += type_bytes(property.type);
    }
    SPLAT_ASSIGN(const Bytes rows, reader_.take(element.count * stride, element.name.c_str()));
    const std::endian order = order_of(encoding_);
    std::vector<double> values(columns.size());
    for (std::size_t i = 0; i < element.count; ++i) {
        const std::byte* const at = rows.data() + i * stride;
        for (std::size_t k = 0; k < columns.size(); ++k)
            values[k] = columns[k].to_double(at + columns[k].at, order);
        row(i, values);
        if (discard_ && (i + 1) % kSceneBlock == 0) discard(rows.first((i + 1) * stride));
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
    const std::string found =
        format("%llu bytes after the last row of the header's count", llu(left));
    if (lenient) return found;
    return damaged(
        "ply data: %s, expected none: the header counts too few rows, or something was "
        "appended to the file; a lenient reader leaves them out",
        found.c_str());
}

Status PlyRows::read_binary(const PlyProperty& property, double& value) {
    if (!property.list_count) return read_number(property.type, property.name, value);
    SPLAT_TRY(read_number(*property.list_count, property.name, value));
    if (value < 0)
        return damaged("ply data: list '%s' before byte %zu has length %.0f", property.name.c_str(),
                       reader_.position(), value);
    const auto bytes = static_cast<std::uint64_t>(value) * type_bytes(property.type);
    SPLAT_ASSIGN([[maybe_unused]] const Bytes items, reader_.take(bytes, property.name.c_str()));
    return {};
}

Status PlyRows::read_number(NumberType type, const std::string& name, double& value) {
    SPLAT_ASSIGN(const Bytes at, reader_.take(type_bytes(type), name.c_str()));
    value = number_type_row(type).to_double(at.data(), order_of(encoding_));
    return {};
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
        return damaged("ply data: line %zu: '%s' is '%s', expected a number", line_, name.c_str(),
                       std::string(word.substr(0, 40)).c_str());
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
        return damaged("ply data: line %zu: list '%s' of length %g, but %zu bytes are left", line_,
                       property.name.c_str(), value, text_.size());
    double item = 0;
    for (auto left = static_cast<std::uint64_t>(value); left > 0; --left)
        SPLAT_TRY(read_word(property.name, item));
    return {};
}

}  // namespace splat::io
