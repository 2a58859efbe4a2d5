#include "io/sample_weights.h"

#include <gtest/gtest.h>

#include "io/compress.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"

namespace splat::test {
namespace {

std::string little(std::uint64_t value, std::size_t bytes) {
    std::string text;
    for (; text.size() < bytes; value >>= 8U) text += static_cast<char>(value & 0xFFU);
    return text;
}

/// Without the two bytes before and the four after it that make it a zlib stream.
std::string deflate_raw(const std::string& data) {
    const io::Buffer packed = zlib_stream(io::as_bytes(data));
    return std::string(io::as_text(packed)).substr(2, packed.size() - 6);
}

std::uint64_t moved(std::uint64_t place, std::int64_t shift) {
    return place + static_cast<std::uint64_t>(shift);
}

std::string end_of_zip64(std::uint64_t count, std::uint64_t bytes, std::uint64_t start) {
    const std::string record = "PK\x06\x06" + little(44, 8) + little(45, 2) + little(45, 2) +
                               little(0, 8) + little(count, 8) + little(count, 8) +
                               little(bytes, 8) + little(start, 8);
    return record + "PK\x06\x07" + little(0, 4) + little(start + bytes, 8) + little(1, 4);
}

}  // namespace

ZipPart::ZipPart(std::string part_name, std::string data, bool deflated)
    : name(std::move(part_name)),
      packed(deflated ? deflate_raw(data) : data),
      method(deflated ? 8 : 0),
      crc(io::crc32_of(io::as_bytes(data))),
      packed_bytes(packed.size()),
      bytes(data.size()),
      local_name(name),
      local_bytes(0) {
    flags = 1U << 3U;  // local sizes are zeros
}

io::Buffer sample_zip(const std::vector<ZipPart>& parts, const ZipEnd& end) {
    std::string file;
    std::string directory;
    for (const ZipPart& part : parts) {
        const std::uint64_t start = moved(file.size(), part.shift);
        const std::string extra = !part.zip64
                                      ? ""
                                      : little(1, 2) + little(24, 2) + little(part.bytes, 8) +
                                            little(part.packed_bytes, 8) + little(start, 8);
        const auto field = [&](std::uint64_t value) {
            return little(part.zip64 ? 0xFFFF'FFFFU : value, 4);
        };
        const std::string common =
            little(20, 2) + little(part.flags, 2) + little(part.method, 2) + little(0, 4);
        directory += "PK\x01\x02" + little(20, 2) + common + little(part.crc, 4) +
                     field(part.packed_bytes) + field(part.bytes) + little(part.name.size(), 2) +
                     little(extra.size(), 2) + little(0, 10) + field(start) + part.name + extra;
        file += "PK\x03\x04" + common + little(0, 4) + little(part.local_bytes, 4) +
                little(part.local_bytes, 4) + little(part.local_name.size(), 2) + little(0, 2) +
                part.local_name + part.packed;
    }
    const std::uint64_t start = moved(file.size(), end.shift);
    const std::uint64_t count = moved(parts.size(), end.more_entries);
    file += directory;
    if (end.zip64) file += end_of_zip64(count, directory.size(), start);
    const auto field = [&](std::uint64_t value, std::size_t bytes) {
        return little(end.zip64 ? ~std::uint64_t{0} : value, bytes);
    };
    file += "PK\x05\x06" + little(0, 4) + field(count, 2) + field(count, 2) +
            field(directory.size(), 4) + field(start, 4) + little(end.comment.size(), 2) +
            end.comment;
    return bytes_of(file);
}

PickleText& PickleText::text(const std::string& value) {
    return raw("X" + little(value.size(), 4) + value);
}

PickleText& PickleText::integer(std::int64_t value) {
    if (value >= 0 && value < 256) return raw("K" + little(static_cast<std::uint64_t>(value), 1));
    return raw("\x8a\x08" + little(static_cast<std::uint64_t>(value), 8));
}

PickleText& PickleText::real(double value) {
    io::Buffer bytes;
    io::put(bytes, value, std::endian::big);
    return raw("G" + std::string(io::as_text(bytes)));
}

PickleText& PickleText::tuple(const std::vector<std::int64_t>& values) {
    raw("(");
    for (const std::int64_t value : values) integer(value);
    return raw("t");
}

PickleText& PickleText::tensor(const std::string& storage_type, const std::string& key,
                               std::int64_t stored, std::int64_t offset,
                               const std::vector<std::int64_t>& dims,
                               const std::vector<std::int64_t>& strides, bool legacy) {
    global("torch._utils", "_rebuild_tensor_v2").raw("((").text("storage");
    global("torch", storage_type).text(key).text("cpu").integer(stored).raw(legacy ? "NtQ" : "tQ");
    integer(offset);
    tuple(dims).tuple(strides).raw("\x89").global("collections", "OrderedDict").raw(")R");
    return raw("tR");
}

io::Buffer sample_pth(const std::string& pickle, const std::vector<std::string>& storages,
                      const std::string& byte_order) {
    std::vector<ZipPart> parts = {{"x/data.pkl", pickle}, {"x/byteorder", byte_order}};
    for (std::size_t i = 0; i < storages.size(); ++i)
        parts.emplace_back("x/data/" + std::to_string(i), storages[i]);
    parts.emplace_back("x/version", "3\n");
    return sample_zip(parts);
}

io::Buffer sample_pth() {
    PickleText pickle;
    pickle.raw("}(").text("a").tensor("FloatStorage", "0", 6, 0, {2, 3}, {1, 2});
    pickle.text("b").tensor("HalfStorage", "1", 2, 1, {}, {}).raw("u");
    return sample_pth(pickle.done(), {raw_bytes<float>({1, 2, 3, 4, 5, 6}),
                                      raw_bytes<std::uint16_t>({0, 0x3C00})});
}

LegacyPth legacy_parts() {
    PickleText pickle;
    pickle.raw("}(").text("a").tensor("FloatStorage", "7", 6, 0, {2, 3}, {1, 2}, true);
    pickle.text("b").tensor("HalfStorage", "12", 2, 1, {}, {}, true).raw("u");
    LegacyPth parts{.saved = pickle.done()};
    return parts;
}

io::Buffer sample_legacy_pth(const LegacyPth& parts) {
    PickleText keys;
    keys.raw("](");
    for (const std::string& key : parts.keys) keys.text(key);
    std::string file = std::string("\x80\x02\x8a\x0al\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.", 15) +
                       parts.protocol + parts.machine + parts.saved + keys.raw("e").done();
    for (std::size_t i = 0; i < parts.storages.size(); ++i)
        file += little(parts.counts[i], 8) + parts.storages[i];
    return bytes_of(file);
}

io::NamedTensors sample_tensors() {
    io::NamedTensors tensors;
    for (const io::NamedTensor& tensor :
         {io::NamedTensor{"first.weight", {2, 3}, io::NumberType::kF32, {1, -2, 3, 0.5F, 0, 65504}},
          io::NamedTensor{"number", {}, io::NumberType::kF32, {7}},
          io::NamedTensor{"none", {0, 4}, io::NumberType::kF32, {}}})
        EXPECT_TRUE(tensors.add(tensor).ok());
    return tensors;
}

io::Buffer sample_safetensors(const std::string& header, std::size_t data_bytes) {
    return bytes_of(little(header.size(), 8) + header + std::string(data_bytes, '\x01'));
}

}  // namespace splat::test
