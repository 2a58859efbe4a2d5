#include "support/npz.h"

#include <lzma.h>
#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include "core/checked_math.h"

namespace splat::test {
namespace {

using Bytes = std::span<const std::byte>;

/// Deflate packs at most 1032 : 1; a header that claims more is damaged.
constexpr std::uint64_t kMaxRatio = 1032;

Status bad(const std::string& what, const std::string& reason) {
    return error(Code::kInvalidArgument, "%s: %s", what.c_str(), reason.c_str());
}

std::optional<Bytes> slice(Bytes from, std::uint64_t offset, std::uint64_t size) {
    if (offset > from.size() || size > from.size() - offset) return std::nullopt;
    return from.subspan(offset, size);
}

/// Little-endian number; the caller has checked the range.
template <class T>
T number(Bytes from, std::size_t offset) {
    T value{};
    std::memcpy(&value, from.data() + offset, sizeof value);
    return value;
}

struct Member {
    std::string name;
    std::uint16_t method = 0;
    std::uint32_t crc = 0;
    std::uint32_t packed_bytes = 0;
    std::uint32_t bytes = 0;
    std::uint32_t header_offset = 0;
};

constexpr std::size_t kEndBytes = 22;      // end of central directory
constexpr std::size_t kCentralBytes = 46;  // one entry of it, without its names
constexpr std::size_t kLocalBytes = 30;    // header in front of a member, without its names

Result<std::vector<Member>> read_directory(Bytes file, const std::string& what) {
    std::optional<std::size_t> end;  // only a comment of at most 64 KiB follows the record
    for (std::size_t back = kEndBytes; back <= file.size() && back <= kEndBytes + 0xFFFF; ++back) {
        if (number<std::uint32_t>(file, file.size() - back) != 0x06054b50) continue;
        end = file.size() - back;
        break;
    }
    if (!end) return bad(what, "no end-of-directory record; not a zip file, or truncated");
    const auto count = number<std::uint16_t>(file, *end + 10);
    std::size_t at = number<std::uint32_t>(file, *end + 16);
    std::vector<Member> members;
    for (std::size_t i = 0; i < count; ++i) {
        const auto head = slice(file, at, kCentralBytes);
        if (!head || number<std::uint32_t>(*head, 0) != 0x02014b50)
            return bad(what, format("directory entry %zu of %u is damaged", i, count));
        Member member;
        member.method = number<std::uint16_t>(*head, 10);
        member.crc = number<std::uint32_t>(*head, 16);
        member.packed_bytes = number<std::uint32_t>(*head, 20);
        member.bytes = number<std::uint32_t>(*head, 24);
        member.header_offset = number<std::uint32_t>(*head, 42);
        const auto name_bytes = number<std::uint16_t>(*head, 28);
        const auto name = slice(file, at + kCentralBytes, name_bytes);
        if (!name) return bad(what, format("the name of directory entry %zu is cut off", i));
        member.name.assign(reinterpret_cast<const char*>(name->data()), name->size());
        at += kCentralBytes + name_bytes + number<std::uint16_t>(*head, 30) +
              number<std::uint16_t>(*head, 32);
        members.push_back(std::move(member));
    }
    return members;
}

Result<std::vector<std::byte>> inflate_raw(Bytes packed, std::size_t bytes,
                                           const std::string& what) {
    std::vector<std::byte> out(bytes);
    z_stream stream{};
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return bad(what, "zlib did not start");
    std::byte none{};  // zlib wants a pointer even for nothing
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.empty() ? &none : out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    const int result = inflate(&stream, Z_FINISH);
    const bool whole = result == Z_STREAM_END && stream.total_out == bytes;
    inflateEnd(&stream);
    if (!whole) return bad(what, format("deflate data is damaged (zlib %d)", result));
    return out;
}

Result<std::vector<std::byte>> read_member(Bytes file, const Member& member,
                                           const std::string& what) {
    const auto head = slice(file, member.header_offset, kLocalBytes);
    if (!head || number<std::uint32_t>(*head, 0) != 0x04034b50)
        return bad(what, "its local header is outside the file or damaged");
    const std::uint64_t start = std::uint64_t{member.header_offset} + kLocalBytes +
                                number<std::uint16_t>(*head, 26) + number<std::uint16_t>(*head, 28);
    const auto packed = slice(file, start, member.packed_bytes);
    if (!packed) return bad(what, "its data reaches beyond the end of the file");
    if (member.bytes / kMaxRatio > member.packed_bytes)
        return bad(what, format("%u bytes cannot come from %u", member.bytes, member.packed_bytes));
    std::vector<std::byte> bytes;
    if (member.method == 8) {
        SPLAT_ASSIGN(bytes, inflate_raw(*packed, member.bytes, what));
    } else if (member.method == 0 && member.bytes == member.packed_bytes) {
        bytes.assign(packed->begin(), packed->end());
    } else {
        return bad(what, format("compression method %u, expected 0 or 8", member.method));
    }
    const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
    if (!bytes.empty() && crc != member.crc) return bad(what, "its CRC does not match");
    return bytes;
}

/// Enough for any golden file; a damaged one does not take all memory.
constexpr std::size_t kMostUnpacked = std::size_t{1} << 30;

bool is_xz(Bytes file) {
    constexpr std::string_view kMark(
        "\xFD"
        "7zXZ\0",
        6);
    return file.size() >= kMark.size() && std::memcmp(file.data(), kMark.data(), kMark.size()) == 0;
}

Result<std::vector<std::byte>> unpack_xz(Bytes packed, const std::string& what) {
    std::vector<std::byte> out;
    std::vector<std::byte> piece(std::size_t{1} << 20);
    lzma_stream stream = LZMA_STREAM_INIT;
    if (lzma_stream_decoder(&stream, kMostUnpacked, LZMA_CONCATENATED) != LZMA_OK)
        return bad(what, "liblzma did not start");
    stream.next_in = reinterpret_cast<const std::uint8_t*>(packed.data());
    stream.avail_in = packed.size();
    lzma_ret result = LZMA_OK;
    while (result == LZMA_OK && out.size() <= kMostUnpacked) {
        stream.next_out = reinterpret_cast<std::uint8_t*>(piece.data());
        stream.avail_out = piece.size();
        result = lzma_code(&stream, LZMA_FINISH);
        out.insert(out.end(), piece.begin(),
                   piece.end() - static_cast<std::ptrdiff_t>(stream.avail_out));
    }
    lzma_end(&stream);
    if (result != LZMA_STREAM_END)
        return bad(what, format("xz data is damaged or too large (liblzma %d)", int{result}));
    return out;
}

/// 0 for a dtype that is not supported. "U12" is text of at most 12 characters of 4 bytes.
std::size_t item_bytes(std::string_view dtype) {
    if (dtype.size() >= 2 && dtype.size() <= 6 && dtype.front() == 'U') {
        std::size_t characters = 0;
        for (const char c : dtype.substr(1)) {
            if (c < '0' || c > '9') return 0;
            characters = characters * 10 + static_cast<std::size_t>(c - '0');
        }
        return 4 * characters;
    }
    constexpr std::pair<std::string_view, std::size_t> kTypes[] = {
        {"f4", 4}, {"f8", 8}, {"f2", 2}, {"i1", 1}, {"i2", 2}, {"i4", 4},
        {"i8", 8}, {"u1", 1}, {"u2", 2}, {"u4", 4}, {"u8", 8}, {"b1", 1},
    };
    for (const auto& [name, bytes] : kTypes)
        if (name == dtype) return bytes;
    return 0;
}

/// The text between `key` and `stop` in numpy's header, a Python dict literal.
std::optional<std::string_view> field(std::string_view header, std::string_view key,
                                      std::string_view stop) {
    const std::size_t at = header.find(key);
    if (at == std::string_view::npos) return std::nullopt;
    const std::size_t start = at + key.size();
    const std::size_t end = header.find(stop, start);
    if (end == std::string_view::npos) return std::nullopt;
    return header.substr(start, end - start);
}

Result<std::vector<std::size_t>> parse_shape(std::string_view text, const std::string& what) {
    std::vector<std::size_t> shape;
    std::optional<std::uint64_t> dim;
    for (const char c : text) {
        if (c >= '0' && c <= '9') {
            const auto shifted = checked_mul(dim.value_or(0), 10);
            if (shifted) dim = checked_add(*shifted, static_cast<std::uint64_t>(c - '0'));
            if (!shifted || !dim) return bad(what, "a dimension overflows");
        } else if (c == ',' || c == ' ') {
            if (dim) shape.push_back(*dim);
            dim.reset();
        } else {
            return bad(what, "the shape in its header is damaged");
        }
    }
    if (dim) shape.push_back(*dim);
    return shape;
}

template <class To, class From>
std::vector<To> convert(const NpyArray& array) {
    std::vector<To> values(array.elements());
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<To>(number<From>(array.bytes, i * sizeof(From)));
    return values;
}

Status wrong_type(const NpyArray& array, const char* expected) {
    return error(Code::kInvalidArgument, "array of dtype %s, expected %s", array.dtype.c_str(),
                 expected);
}

}  // namespace

std::size_t NpyArray::elements() const {
    std::size_t product = 1;
    for (const std::size_t dim : shape) product *= dim;
    return product;
}

Result<std::vector<float>> NpyArray::f32() const {
    if (dtype != "f4") return wrong_type(*this, "f4");
    return convert<float, float>(*this);
}

Result<std::vector<double>> NpyArray::f64() const {
    if (dtype == "f4") return convert<double, float>(*this);
    if (dtype == "f8") return convert<double, double>(*this);
    return wrong_type(*this, "f4 or f8");
}

Result<std::vector<std::int64_t>> NpyArray::ints() const {
    if (dtype == "i4") return convert<std::int64_t, std::int32_t>(*this);
    if (dtype == "i8") return convert<std::int64_t, std::int64_t>(*this);
    if (dtype == "u1" || dtype == "b1") return convert<std::int64_t, std::uint8_t>(*this);
    return wrong_type(*this, "i4, i8, u1 or b1");
}

Result<std::vector<std::string>> NpyArray::strings() const {
    if (!dtype.starts_with("U")) return wrong_type(*this, "U");
    const std::size_t characters = item_bytes(dtype) / 4;
    std::vector<std::string> texts(elements());
    for (std::size_t i = 0; i < texts.size() * characters; ++i) {
        const auto character = number<std::uint32_t>(bytes, 4 * i);
        if (character >= 128) return error(Code::kInvalidArgument, "text that is not ASCII");
        if (character != 0) texts[i / characters] += static_cast<char>(character);
    }
    return texts;
}

Result<NpyArray> parse_npy(std::span<const std::byte> bytes, const std::string& what) {
    constexpr char kMagic[] = "\x93NUMPY";
    if (bytes.size() < 12 || std::memcmp(bytes.data(), kMagic, 6) != 0)
        return bad(what, "not a .npy array, or truncated");
    const bool first_version = bytes[6] == std::byte{1};
    const std::size_t start = first_version ? 10 : 12;
    const std::size_t length =
        first_version ? number<std::uint16_t>(bytes, 8) : number<std::uint32_t>(bytes, 8);
    const auto raw = slice(bytes, start, length);
    if (!raw) return bad(what, "its header is cut off");
    const std::string_view header(reinterpret_cast<const char*>(raw->data()), raw->size());

    const auto descr = field(header, "'descr': '", "'");
    const auto order = field(header, "'fortran_order': ", ",");
    const auto dims = field(header, "'shape': (", ")");
    if (!descr || !order || !dims) return bad(what, "its header lacks descr, order or shape");
    if (*order != "False") return bad(what, "it is in Fortran order, expected C order");
    NpyArray array;
    array.dtype = descr->size() >= 3 ? descr->substr(1) : *descr;
    const std::size_t item = item_bytes(array.dtype);
    if (item == 0 || (descr->front() != '<' && descr->front() != '|'))
        return bad(what, "dtype '" + std::string(*descr) + "' is not supported");
    SPLAT_ASSIGN(array.shape, parse_shape(*dims, what));
    std::optional<std::uint64_t> total = item;
    for (const std::size_t dim : array.shape)
        if (total) total = checked_mul(*total, dim);
    const Bytes data = bytes.subspan(start + length);
    if (!total || *total != data.size())
        return bad(what, format("%zu bytes of data do not fit its shape (%.*s)", data.size(),
                                static_cast<int>(dims->size()), dims->data()));
    array.bytes.assign(data.begin(), data.end());
    return array;
}

Result<Npz> Npz::parse(std::span<const std::byte> file, const std::string& what) {
    Npz npz;
    npz.what_ = what;
    SPLAT_ASSIGN(const std::vector<Member> members, read_directory(file, what));
    for (const Member& member : members) {
        const std::string where = what + ": " + member.name;
        SPLAT_ASSIGN(const std::vector<std::byte> bytes, read_member(file, member, where));
        SPLAT_ASSIGN(NpyArray array, parse_npy(bytes, where));
        std::string name = member.name;
        if (name.ends_with(".npy")) name.resize(name.size() - 4);
        if (!npz.arrays_.emplace(name, std::move(array)).second) return bad(where, "appears twice");
    }
    return npz;
}

Result<Npz> Npz::read(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) return bad(path, "cannot be opened");
    const auto size = static_cast<std::streamsize>(file.tellg());
    std::vector<std::byte> bytes(static_cast<std::size_t>(size));
    file.seekg(0);
    if (!file.read(reinterpret_cast<char*>(bytes.data()), size)) return bad(path, "read failed");
    if (is_xz(bytes)) {
        SPLAT_ASSIGN(bytes, unpack_xz(bytes, path));
    }
    return parse(bytes, path);
}

Result<const NpyArray*> Npz::find(const std::string& name) const {
    if (const auto at = arrays_.find(name); at != arrays_.end()) return &at->second;
    std::string list;
    for (const std::string& other : names()) list += " " + other;
    return bad(what_, "no array '" + name + "'; there are:" + list);
}

std::vector<std::string> Npz::names() const {
    std::vector<std::string> names;
    for (const auto& [name, array] : arrays_) names.push_back(name);
    return names;
}

}  // namespace splat::test
