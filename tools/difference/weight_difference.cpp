// Stores weights as their difference from others of nearly the same values, and rebuilds the file, equal in all bytes.
//
//   weight_difference make BASE TARGET OUT         write the difference of TARGET from BASE
//   weight_difference apply BASE DIFFERENCE OUT    write TARGET again
//
// BASE and TARGET are safetensors files; all tensors of TARGET are F16 and lie one behind the other. A difference
// holds, little-endian:
//
//   char[8]  "splatdif"
//   u32      version, 1
//   u32      CRC-32 of BASE
//   u32      CRC-32 of TARGET
//   u64      bytes of TARGET's header, the JSON text
//   u64      bytes of TARGET's data, two for each number
//   3 times  u64 bytes of a zlib stream, and the stream: the header; the low bytes of all differences; the high bytes
//
// The bits of an F16 become an integer that grows with the number. A difference is that of a number of TARGET less that
// of BASE's tensor of the same name and shape, or less that of 0 where there is none; modulo 2^16, zigzag (0, -1, 1, -2
// become 0, 1, 2, 3). Differences are sorted by the exponent of what they are less, as their sizes depend on it, which
// saves a seventh.

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/os/console.h"
#include "core/os/file.h"
#include "core/os/path.h"

namespace {

using Json = nlohmann::json;
using Bits = std::vector<std::uint16_t>;

constexpr std::string_view kMagic = "splatdif";
constexpr std::uint32_t kVersion = 1;
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;  // a file, and what is inflated
constexpr const char* kRenew =
    "; restore the file, or write it again with 'weight_difference make'";

/// What is wrong, with the file's name, and what to do.
struct Failure : std::runtime_error {
    using std::runtime_error::runtime_error;
};

std::string text_of(std::uint64_t number) {
    return std::to_string(number);
}

std::string read_file(const std::string& path) {
    std::error_code error;
    const std::uint64_t size = std::filesystem::file_size(splat::os::path_of(path), error);
    if (error) throw Failure(path + ": cannot be read: " + error.message() + "; name a file");
    if (size > kMaxBytes)
        throw Failure(path + ": has " + text_of(size) + " bytes, expected at most " +
                      text_of(kMaxBytes) + "; name a smaller file");
    std::ifstream stream(splat::os::path_of(path), std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    if (!stream.is_open() || stream.bad() || bytes.size() != size)
        throw Failure(path + ": " + text_of(bytes.size()) + " bytes were read, expected " +
                      text_of(size) + "; check its permissions and the disk");
    return bytes;
}

/// `path` holds the old bytes or all of the new ones at any time.
void write_file(const std::string& path, const std::string& bytes) {
    const std::string temporary = splat::os::temporary_name(path);
    std::ofstream stream(splat::os::path_of(temporary), std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    const bool written = !stream.fail();
    if (written && splat::os::rename(temporary, path) == 0) return;
    const std::string reason = written ? ": " + splat::os::reason(errno) : "";
    splat::os::remove(temporary);
    throw Failure(path + ": " + text_of(bytes.size()) + " bytes cannot be written" + reason +
                  "; check the folder and the disk");
}

std::uint32_t checksum(const std::string& bytes) {
    return static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

template <class Number>
void append(std::string& bytes, Number number) {
    for (std::size_t i = 0; i < sizeof number; ++i)
        bytes += static_cast<char>(static_cast<unsigned char>(number >> (8 * i)));
}

std::uint16_t bits_at(std::string_view bytes, std::size_t index) {
    const auto low = static_cast<unsigned char>(bytes[2 * index]);
    const auto high = static_cast<unsigned char>(bytes[2 * index + 1]);
    return static_cast<std::uint16_t>(low | (high << 8));
}

/// Reads a file from front to back, never behind its end.
class Reader {
  public:
    Reader(std::string path, std::string_view bytes) : path_(std::move(path)), bytes_(bytes) {}

    std::string_view take(std::uint64_t count, const std::string& what) {
        if (count > bytes_.size() - place_)
            throw Failure(path_ + ": " + what + " at byte " + text_of(place_) + ": expected " +
                          text_of(count) + " bytes, got " + text_of(bytes_.size() - place_) +
                          kRenew);
        const std::string_view part = bytes_.substr(place_, static_cast<std::size_t>(count));
        place_ += part.size();
        return part;
    }

    template <class Number>
    Number number(const std::string& what) {
        Number value = 0;
        std::size_t shift = 0;
        for (const char byte : take(sizeof value, what)) {
            const Number part = static_cast<unsigned char>(byte);
            value = static_cast<Number>(value | (part << shift));
            shift += 8;
        }
        return value;
    }

    /// A size of something that will be in memory.
    std::uint64_t size(const std::string& what) {
        const std::size_t before = place_;
        const auto bytes = number<std::uint64_t>(what);
        if (bytes > kMaxBytes)
            throw Failure(path_ + ": " + what + " at byte " + text_of(before) +
                          ": expected at most " + text_of(kMaxBytes) + ", got " + text_of(bytes) +
                          kRenew);
        return bytes;
    }

    [[nodiscard]] std::string_view rest() const { return bytes_.substr(place_); }

  private:
    std::string path_;
    std::string_view bytes_;
    std::size_t place_ = 0;
};

// ---- Safetensors ----

struct Tensor {
    std::string name;
    bool half = false;
    std::vector<std::uint64_t> shape;
    std::uint64_t begin = 0, end = 0;  // bytes of the data
};

struct Weights {
    std::string_view header, data;  // parts of the file
    std::vector<Tensor> tensors;    // in the order of their data
};

std::vector<std::uint64_t> numbers_of(const Json& row, const char* key) {
    std::vector<std::uint64_t> numbers;
    if (!row.is_object() || !row.contains(key) || !row[key].is_array()) return numbers;
    for (const Json& number : row[key])
        numbers.push_back(number.is_number_unsigned() ? number.get<std::uint64_t>()
                                                      : std::numeric_limits<std::uint64_t>::max());
    return numbers;
}

Tensor tensor_of(const std::string& path, const std::string& name, const Json& row,
                 std::uint64_t data_bytes) {
    const std::vector<std::uint64_t> place = numbers_of(row, "data_offsets");
    Tensor tensor{name, false, numbers_of(row, "shape"), 0, 0};
    if (place.size() != 2 || place[0] > place[1] || place[1] > data_bytes)
        throw Failure(path + ": tensor '" + name + "': expected data_offsets within the " +
                      text_of(data_bytes) + " bytes of data, got " + row.dump() +
                      "; name a whole safetensors file");
    tensor.begin = place[0];
    tensor.end = place[1];
    tensor.half = row.contains("dtype") && row["dtype"] == "F16";
    return tensor;
}

Weights weights_of(const std::string& path, std::string_view bytes) {
    Reader reader(path, bytes);
    Weights weights;
    weights.header = reader.take(reader.size("bytes of the header"), "header");
    weights.data = reader.rest();
    const Json header = Json::parse(weights.header, nullptr, false);
    if (!header.is_object())
        throw Failure(path + ": the header of " + text_of(weights.header.size()) +
                      " bytes is no JSON object; name a safetensors file");
    for (const auto& [name, row] : header.items())
        if (name != "__metadata__")
            weights.tensors.push_back(tensor_of(path, name, row, weights.data.size()));
    std::sort(weights.tensors.begin(), weights.tensors.end(), [](const auto& a, const auto& b) {
        return std::pair(a.begin, a.end) < std::pair(b.begin, b.end);
    });
    return weights;
}

/// All tensors are F16, and no byte of the data is outside of them or in two of them.
void check_target(const std::string& path, const Weights& weights) {
    std::uint64_t end = 0;
    for (const Tensor& tensor : weights.tensors) {
        if (!tensor.half || tensor.begin % 2 != 0 || tensor.end % 2 != 0)
            throw Failure(path + ": tensor '" + tensor.name +
                          "': expected F16, got another dtype or an odd byte; convert it with "
                          "'vkrun weights convert --half'");
        if (tensor.begin != end)
            throw Failure(path + ": tensor '" + tensor.name + "' begins at byte " +
                          text_of(tensor.begin) + " of the data, expected " + text_of(end) +
                          "; convert the file with 'vkrun weights convert'");
        end = tensor.end;
    }
    if (end != weights.data.size())
        throw Failure(path + ": the tensors have " + text_of(end) + " bytes of data, the file " +
                      text_of(weights.data.size()) + "; name a whole safetensors file");
}

// ---- Differences ----

/// For each number of the target the one of the base, or 0.
Bits expectation(const Weights& base, const Weights& target) {
    std::map<std::string, const Tensor*> named;
    for (const Tensor& tensor : base.tensors)
        if (tensor.half) named[tensor.name] = &tensor;
    Bits bits(target.data.size() / 2, 0);
    for (const Tensor& tensor : target.tensors) {
        const auto found = named.find(tensor.name);
        const std::uint64_t size = tensor.end - tensor.begin;
        if (found == named.end() || found->second->shape != tensor.shape ||
            found->second->end - found->second->begin != size)
            continue;
        const std::string_view from = base.data.substr(found->second->begin, size);
        for (std::size_t i = 0; i < size / 2; ++i) bits[tensor.begin / 2 + i] = bits_at(from, i);
    }
    return bits;
}

/// The bits of an F16 as an integer that grows with the number, and back.
std::uint16_t ordered(std::uint16_t bits) {
    return static_cast<std::uint16_t>((bits & 0x8000U) != 0 ? ~bits : bits | 0x8000U);
}

std::uint16_t unordered(std::uint16_t order) {
    return static_cast<std::uint16_t>((order & 0x8000U) != 0 ? order & 0x7fffU : ~order);
}

std::uint16_t zigzag(std::uint16_t difference) {
    const bool negative = (difference & 0x8000U) != 0;
    return static_cast<std::uint16_t>((difference * 2U) ^ (negative ? 0xffffU : 0U));
}

std::uint16_t unzigzag(std::uint16_t code) {
    return static_cast<std::uint16_t>((code / 2U) ^ ((code & 1U) != 0 ? 0xffffU : 0U));
}

/// The places of all numbers, sorted by exponents; those of one exponent stay in order.
std::vector<std::size_t> by_exponent(const Bits& bits) {
    constexpr std::size_t kExponents = 32;
    const auto exponent = [&](std::size_t i) { return (bits[i] >> 10) & (kExponents - 1); };
    std::array<std::size_t, kExponents + 1> next = {};
    for (std::size_t i = 0; i < bits.size(); ++i) ++next[exponent(i) + 1];
    for (std::size_t i = 0; i < kExponents; ++i) next[i + 1] += next[i];
    std::vector<std::size_t> places(bits.size());
    for (std::size_t i = 0; i < bits.size(); ++i) places[next[exponent(i)]++] = i;
    return places;
}

void append_deflated(std::string& bytes, std::string_view block) {
    z_stream stream = {};
    // Z_FILTERED: of such bytes single values repeat, hardly ever strings of them.
    int status =
        deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, MAX_WBITS, MAX_MEM_LEVEL, Z_FILTERED);
    std::string deflated(status == Z_OK ? deflateBound(&stream, block.size()) : 0, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(block.data()));
    stream.avail_in = static_cast<uInt>(block.size());  // below kMaxBytes
    stream.next_out = reinterpret_cast<Bytef*>(deflated.data());
    stream.avail_out = static_cast<uInt>(deflated.size());
    if (status == Z_OK) status = deflate(&stream, Z_FINISH);
    deflateEnd(&stream);
    if (status != Z_STREAM_END)
        throw Failure("zlib cannot deflate " + text_of(block.size()) + " bytes, status " +
                      std::to_string(status) + "; free some memory");
    append(bytes, std::uint64_t{stream.total_out});
    bytes.append(deflated, 0, stream.total_out);
}

std::string inflated(const std::string& path, Reader& reader, std::uint64_t size,
                     const std::string& what) {
    const std::string_view deflated = reader.take(reader.size("bytes of the " + what), what);
    std::string block(size, '\0');
    uLongf written = size;
    uLong taken = deflated.size();
    const int status = uncompress2(reinterpret_cast<Bytef*>(block.data()), &written,
                                   reinterpret_cast<const Bytef*>(deflated.data()), &taken);
    if (status != Z_OK || written != size || taken != deflated.size())
        throw Failure(path + ": the " + what + ": expected a zlib stream of " + text_of(size) +
                      " bytes, got zlib's status " + std::to_string(status) + " after " +
                      text_of(written) + kRenew);
    return block;
}

std::string make(const std::string& base_path, const std::string& target_path) {
    const std::string base_bytes = read_file(base_path);
    const std::string target_bytes = read_file(target_path);
    const Weights target = weights_of(target_path, target_bytes);
    check_target(target_path, target);
    const Bits expected = expectation(weights_of(base_path, base_bytes), target);
    std::string low, high;
    for (const std::size_t i : by_exponent(expected)) {
        const int difference = ordered(bits_at(target.data, i)) - ordered(expected[i]);
        const std::uint16_t code = zigzag(static_cast<std::uint16_t>(difference));
        low += static_cast<char>(static_cast<unsigned char>(code & 0xffU));
        high += static_cast<char>(static_cast<unsigned char>(code >> 8));
    }
    std::string bytes(kMagic);
    append(bytes, kVersion);
    append(bytes, checksum(base_bytes));
    append(bytes, checksum(target_bytes));
    append(bytes, std::uint64_t{target.header.size()});
    append(bytes, std::uint64_t{target.data.size()});
    for (const std::string_view block :
         {target.header, std::string_view(low), std::string_view(high)})
        append_deflated(bytes, block);
    return bytes;
}

void check_checksum(const std::string& path, std::uint32_t expected, std::uint32_t got,
                    const char* advice) {
    if (expected != got)
        throw Failure(path + ": expected CRC-32 " + text_of(expected) + ", got " + text_of(got) +
                      advice);
}

std::string apply(const std::string& base_path, const std::string& path) {
    const std::string base_bytes = read_file(base_path);
    const std::string difference = read_file(path);
    Reader reader(path, difference);
    if (reader.take(kMagic.size(), "signature") != kMagic)
        throw Failure(path + ": expected '" + std::string(kMagic) +
                      "' in front; name a file of 'weight_difference make'");
    if (const auto version = reader.number<std::uint32_t>("version"); version != kVersion)
        throw Failure(path + ": expected version " + text_of(kVersion) + ", got " +
                      text_of(version) + "; use the program that belongs to the file");
    const auto base_checksum = reader.number<std::uint32_t>("CRC-32 of the base");
    const auto target_checksum = reader.number<std::uint32_t>("CRC-32 of the target");
    check_checksum(base_path, base_checksum, checksum(base_bytes),
                   "; name the base of which the difference was made");
    const std::uint64_t header_bytes = reader.size("bytes of the header");
    const std::uint64_t data_bytes = reader.size("bytes of the data");
    const std::string header = inflated(path, reader, header_bytes, "header");
    const std::string low = inflated(path, reader, data_bytes / 2, "low bytes");
    const std::string high = inflated(path, reader, data_bytes / 2, "high bytes");
    if (!reader.rest().empty())
        throw Failure(path + ": " + text_of(reader.rest().size()) + " bytes behind the end" +
                      kRenew);
    std::string bytes;
    append(bytes, header_bytes);
    bytes += header;
    const std::size_t start = bytes.size();
    bytes.resize(start + data_bytes);
    const Weights target = weights_of(path, bytes);
    check_target(path, target);
    const Bits expected = expectation(weights_of(base_path, base_bytes), target);
    std::size_t next = 0;
    for (const std::size_t i : by_exponent(expected)) {
        const auto code = static_cast<std::uint16_t>(static_cast<unsigned char>(low[next]) |
                                                     static_cast<unsigned char>(high[next]) << 8);
        ++next;
        const int order = ordered(expected[i]) + unzigzag(code);
        const std::uint16_t bits = unordered(static_cast<std::uint16_t>(order));
        bytes[start + 2 * i] = static_cast<char>(static_cast<unsigned char>(bits & 0xffU));
        bytes[start + 2 * i + 1] = static_cast<char>(static_cast<unsigned char>(bits >> 8));
    }
    check_checksum(path, target_checksum, checksum(bytes), kRenew);
    return bytes;
}

}  // namespace

int main(int count, char** words) {
    words = splat::os::arguments(count, words);
    const std::vector<std::string> arguments(words + std::min(count, 1), words + count);
    if (arguments.size() != 4 || (arguments[0] != "make" && arguments[0] != "apply")) {
        std::fputs(
            "usage: weight_difference make BASE TARGET OUT\n"
            "       weight_difference apply BASE DIFFERENCE OUT\n",
            stderr);
        return 2;
    }
    try {
        write_file(arguments[3],
                   (arguments[0] == "make" ? make : apply)(arguments[1], arguments[2]));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "weight_difference: %s\n", error.what());
        return 1;
    }
    return 0;
}
