#include "io/ply_header.h"

#include <algorithm>
#include <charconv>
#include <utility>

namespace splat::io {
namespace {

constexpr std::size_t kMaxHeaderBytes = 1U << 20;
constexpr std::size_t kMaxPlyElements = 64;
constexpr std::size_t kMaxProperties = 1024;

struct TypeName {
    std::string_view name;
    PlyType type;
};

constexpr TypeName kTypeNames[] = {
    {"char", PlyType::kI8},    {"int8", PlyType::kI8},     {"uchar", PlyType::kU8},
    {"uint8", PlyType::kU8},   {"short", PlyType::kI16},   {"int16", PlyType::kI16},
    {"ushort", PlyType::kU16}, {"uint16", PlyType::kU16},  {"int", PlyType::kI32},
    {"int32", PlyType::kI32},  {"uint", PlyType::kU32},    {"uint32", PlyType::kU32},
    {"float", PlyType::kF32},  {"float32", PlyType::kF32}, {"double", PlyType::kF64},
    {"float64", PlyType::kF64}};

using Words = std::vector<std::string_view>;

Words words_of(std::string_view line) {
    Words words;
    while (true) {
        const std::size_t start = line.find_first_not_of(" \t\r");
        if (start == std::string_view::npos) return words;
        line.remove_prefix(start);
        const std::size_t end = std::min(line.find_first_of(" \t\r"), line.size());
        words.push_back(line.substr(0, end));
        line.remove_prefix(end);
    }
}

class HeaderParser {
  public:
    /// The text after the line "ply".
    explicit HeaderParser(std::string_view text) : text_(text) { header_.lines = 1; }

    Result<PlyHeader> parse() {
        while (true) {
            SPLAT_ASSIGN(const Words words, next_line());
            if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
            if (words[0] == "end_header") break;
            if (words[0] == "format") {
                SPLAT_TRY(format_line(words));
            } else if (words[0] == "element") {
                SPLAT_TRY(element_line(words));
            } else if (words[0] == "property") {
                SPLAT_TRY(property_line(words));
            } else {
                return bad("'" + std::string(words[0].substr(0, 40)) +
                           "', expected format, element, property, comment or end_header");
            }
        }
        if (!has_format_) return bad("there is no 'format' line");
        return std::move(header_);
    }

  private:
    Status bad(const std::string& problem) const {
        return error(Code::kFormat, "ply: header line %zu: %s", header_.lines, problem.c_str());
    }

    Result<Words> next_line() {
        ++header_.lines;
        const std::string_view rest = text_.substr(header_.bytes);
        const std::size_t end = rest.substr(0, kMaxHeaderBytes).find('\n');
        if (end == std::string_view::npos) return bad("the header ends without 'end_header'");
        header_.bytes += end + 1;
        if (header_.bytes > kMaxHeaderBytes)
            return error(Code::kUnsupported, "ply: more than %zu bytes of header", kMaxHeaderBytes);
        return words_of(rest.substr(0, end));
    }

    Status format_line(const Words& words) {
        constexpr std::pair<std::string_view, PlyEncoding> kEncodings[] = {
            {"ascii", PlyEncoding::kAscii},
            {"binary_little_endian", PlyEncoding::kLittleEndian},
            {"binary_big_endian", PlyEncoding::kBigEndian}};
        if (words.size() != 3 || words[2] != "1.0") return bad("expected 'format <encoding> 1.0'");
        for (const auto& [name, encoding] : kEncodings)
            if (words[1] == name) {
                header_.encoding = encoding;
                has_format_ = true;
                return {};
            }
        return bad("encoding '" + std::string(words[1].substr(0, 40)) +
                   "', expected ascii, binary_little_endian or binary_big_endian");
    }

    Status element_line(const Words& words) {
        PlyElement element;
        if (words.size() != 3) return bad("expected 'element <name> <count>'");
        const std::string_view count = words[2];
        const auto [end, failed] =
            std::from_chars(count.data(), count.data() + count.size(), element.count);
        if (failed != std::errc() || end != count.data() + count.size())
            return bad("count '" + std::string(count.substr(0, 40)) +
                       "' is not a whole number >= 0");
        element.name = words[1];
        if (header_.find(element.name) != nullptr)
            return bad("a second element '" + element.name + "'");
        if (header_.elements.size() == kMaxPlyElements) return bad("too many elements");
        header_.elements.push_back(std::move(element));
        return {};
    }

    Status property_line(const Words& words) {
        if (header_.elements.empty()) return bad("a property before the first element");
        PlyElement& element = header_.elements.back();
        PlyProperty property;
        const bool list = words.size() == 5 && words[1] == "list";
        if (!list && words.size() != 3)
            return bad(
                "expected 'property <type> <name>' or 'property list <count type> <type> "
                "<name>'");
        if (list) {
            SPLAT_ASSIGN(property.list_count, type_of(words[2]));
            if (*property.list_count >= PlyType::kF32)
                return bad("a list count that is not an integer");
        }
        SPLAT_ASSIGN(property.type, type_of(words[list ? 3 : 1]));
        property.name = words.back();
        if (element.find(property.name))
            return bad("a second property '" + property.name + "' of " + element.name);
        if (element.properties.size() == kMaxProperties) return bad("too many properties");
        element.properties.push_back(std::move(property));
        return {};
    }

    Result<PlyType> type_of(std::string_view word) const {
        for (const TypeName& known : kTypeNames)
            if (known.name == word) return known.type;
        return bad("type '" + std::string(word.substr(0, 40)) +
                   "', expected one such as float or "
                   "uchar");
    }

    std::string_view text_;
    PlyHeader header_;
    bool has_format_ = false;
};

}  // namespace

std::size_t ply_type_bytes(PlyType type) {
    constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return kBytes[static_cast<std::size_t>(type)];
}

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
    if (!is_ply(file)) return error(Code::kFormat, "ply: the first line is not 'ply'");
    const std::string_view text = as_text(file);
    const std::size_t first = text.find('\n') + 1;
    auto parsed = HeaderParser(text.substr(first)).parse();
    if (!parsed.ok()) return parsed;
    parsed.value().bytes += first;
    return parsed;
}

}  // namespace splat::io
