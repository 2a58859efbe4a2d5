#include "io/npy.h"

#include <charconv>

#include "core/checked_math.h"
#include "io/reader.h"

namespace splat::io {
namespace {

constexpr std::string_view kNpyMagic("\x93NUMPY", 6);
constexpr std::size_t kAlignment = 64;
constexpr std::size_t kMaxDims = 32;

Status bad_npy(const std::string& problem) {
    return damaged("npy: %s", problem.c_str());
}

/// The text after 'key': in the header, which is a Python dict literal.
Result<std::string_view> value_of(std::string_view header, const std::string& key) {
    const std::size_t at = header.find("'" + key + "':");
    if (at == std::string_view::npos) return bad_npy("the header has no '" + key + "'");
    std::string_view value = header.substr(at + key.size() + 3);
    value.remove_prefix(std::min(value.find_first_not_of(' '), value.size()));
    return value;
}

Result<std::vector<std::uint64_t>> parse_shape(std::string_view text) {
    if (!text.starts_with('(')) return bad_npy("'shape' is not a tuple");
    text.remove_prefix(1);
    std::vector<std::uint64_t> shape;
    while (true) {
        text.remove_prefix(std::min(text.find_first_not_of(" ,"), text.size()));
        if (text.starts_with(')')) return shape;
        std::uint64_t dim = 0;
        const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), dim);
        if (failed != std::errc() || shape.size() == kMaxDims)
            return bad_npy("'shape' is not a tuple of up to 32 whole numbers");
        shape.push_back(dim);
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    }
}

std::optional<std::uint64_t> elements(const std::vector<std::uint64_t>& shape) {
    std::uint64_t count = 1;
    bool empty = false;
    for (const std::uint64_t dim : shape) empty = empty || dim == 0;
    if (empty) return 0;
    for (const std::uint64_t dim : shape) {
        const auto product = checked_mul(count, dim);
        if (!product) return std::nullopt;
        count = *product;
    }
    return count;
}

/// The values, whose first index varies fastest, in the order in which the last one does.
std::vector<float> row_major(const FloatArray& array) {
    const std::vector<std::uint64_t>& shape = array.shape;
    std::vector<std::uint64_t> index(shape.size());
    std::vector<float> values;
    values.reserve(array.values.size());
    while (values.size() < array.values.size()) {
        std::uint64_t at = 0;
        for (std::size_t dim = shape.size(); dim-- > 0;) at = at * shape[dim] + index[dim];
        values.push_back(array.values[at]);
        for (std::size_t dim = shape.size(); dim-- > 0;) {
            if (++index[dim] < shape[dim]) break;
            index[dim] = 0;
        }
    }
    return values;
}

Result<std::string_view> header_text(Reader& reader) {
    SPLAT_ASSIGN(const Bytes magic, reader.take(kNpyMagic.size(), "magic"));
    if (as_text(magic) != kNpyMagic) return bad_npy("the file does not start like a .npy file");
    std::uint8_t major = 0;
    std::uint8_t minor = 0;
    SPLAT_TRY(reader.read(major, "version"));
    SPLAT_TRY(reader.read(minor, "version"));
    if (major < 1 || major > 3) return unsupported("npy: version %u, expected 1 to 3", major);
    std::uint32_t size = 0;
    if (major == 1) {
        std::uint16_t small = 0;
        SPLAT_TRY(reader.read(small, "header size"));
        size = small;
    } else {
        SPLAT_TRY(reader.read(size, "header size"));
    }
    SPLAT_ASSIGN(const Bytes text, reader.take(size, "header"));
    return as_text(text);
}

}  // namespace

Result<NpyHeader> read_npy_header(Bytes file) {
    Reader reader(file, "npy");
    SPLAT_ASSIGN(const std::string_view text, header_text(reader));
    SPLAT_ASSIGN(const std::string_view type, value_of(text, "descr"));
    SPLAT_ASSIGN(const std::string_view column_major, value_of(text, "fortran_order"));
    SPLAT_ASSIGN(const std::string_view shape, value_of(text, "shape"));
    NpyHeader header;
    SPLAT_ASSIGN(header.shape, parse_shape(shape));
    const std::size_t end = type.substr(0, 16).find('\'', 1);
    if (!type.starts_with('\'') || end == std::string_view::npos || end < 3)
        return unsupported("npy: dtype %s, expected a plain one such as '<f4'",
                           std::string(type.substr(0, 16)).c_str());
    if (std::string_view("<>|=").find(type[1]) == std::string_view::npos)
        return unsupported("npy: dtype %s has no byte order, expected one as in '<f4'",
                           std::string(type.substr(0, end + 1)).c_str());
    header.dtype = type.substr(2, end - 2);
    header.order = type[1] == '>' ? std::endian::big : std::endian::little;
    header.column_major = column_major.starts_with("True");
    if (!header.column_major && !column_major.starts_with("False"))
        return bad_npy("'fortran_order' is neither True nor False");
    const auto count = elements(header.shape);
    if (!count) return bad_npy("the shape has more than 2^64 elements");
    header.elements = *count;
    header.start = reader.position();
    return header;
}

Buffer write_npy_header(const std::string& dtype, const std::vector<std::uint64_t>& shape) {
    std::string header = "{'descr': '" + dtype + "', 'fortran_order': False, 'shape': (";
    for (const std::uint64_t dim : shape) header += std::to_string(dim) + ", ";
    if (shape.size() > 1) header.resize(header.size() - 2);
    header += "), }";
    const std::size_t before = kNpyMagic.size() + 4 + header.size() + 1;
    header.append(round_up(before, kAlignment) - before, ' ');
    header += '\n';
    Buffer file;
    put_text(file, kNpyMagic);
    put(file, std::uint16_t{1});
    put(file, static_cast<std::uint16_t>(header.size()));
    put_text(file, header);
    return file;
}

Result<Bytes> npy_data(Bytes file, const NpyHeader& header) {
    const auto type = npy_type(header.dtype);
    if (!type)
        return unsupported(
            "npy: dtype '%c%s', expected floats, integers or booleans, such as '<f4'",
            header.order == std::endian::big ? '>' : '<', header.dtype.c_str());
    Reader reader(file.subspan(header.start), "npy");
    SPLAT_TRY(reader.need(header.elements, type_bytes(*type), "data"));
    SPLAT_ASSIGN(const Bytes data, reader.take(header.elements * type_bytes(*type), "data"));
    if (reader.left() != 0) return bad_npy(std::to_string(reader.left()) + " bytes after the data");
    return data;
}

Result<FloatArray> read_npy(Bytes file) {
    SPLAT_ASSIGN(const NpyHeader header, read_npy_header(file));
    SPLAT_ASSIGN(const Bytes data, npy_data(file, header));
    FloatArray array;
    array.shape = header.shape;
    array.values.resize(header.elements);
    to_floats(*npy_type(header.dtype), data, array.values.data(), header.order);
    if (header.column_major && header.shape.size() > 1 && header.elements > 0)
        array.values = row_major(array);
    return array;
}

Result<Buffer> write_npy(const FloatArray& array) {
    if (array.shape.size() > kMaxDims || elements(array.shape) != array.values.size())
        return invalid("npy: %zu values do not fit the shape", array.values.size());
    Buffer file = write_npy_header("<f4", array.shape);
    put_bytes(file, std::as_bytes(std::span(array.values)));
    return file;
}

}  // namespace splat::io
