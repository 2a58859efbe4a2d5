#include "support/npz_writer.h"

#include <zlib.h>

#include <cstring>
#include <fstream>

namespace splat::test {
namespace {

template <class To, class From>
NpyArray array_of(const char* dtype, const std::vector<std::size_t>& shape,
                  const std::vector<From>& values) {
    NpyArray array{dtype, shape, {}};
    array.bytes.resize(values.size() * sizeof(To));
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto value = static_cast<To>(values[i]);
        std::memcpy(array.bytes.data() + i * sizeof(To), &value, sizeof value);
    }
    return array;
}

std::string little(std::uint64_t value, std::size_t bytes) {
    std::string text;
    for (; text.size() < bytes; value >>= 8) text += static_cast<char>(value & 0xFF);
    return text;
}

std::string npy(const NpyArray& array) {
    std::string dims;
    for (const std::size_t dim : array.shape) dims += std::to_string(dim) + ",";
    const std::string order = array.dtype == "u1" ? "|" : "<";
    std::string header = "{'descr': '" + order + array.dtype +
                         "', 'fortran_order': False, 'shape': (" + dims + "), }";
    header.resize((10 + header.size() + 1 + 63) / 64 * 64 - 11, ' ');  // the data starts at a multiple of 64
    header += '\n';
    return std::string("\x93NUMPY\x01\x00", 8) + little(header.size(), 2) + header +
           std::string(reinterpret_cast<const char*>(array.bytes.data()), array.bytes.size());
}

}  // namespace

NpyArray npy_f32(const std::vector<std::size_t>& shape, const std::vector<double>& values) {
    return array_of<float>("f4", shape, values);
}

NpyArray npy_f64(const std::vector<std::size_t>& shape, const std::vector<double>& values) {
    return array_of<double>("f8", shape, values);
}

NpyArray npy_i32(const std::vector<std::int32_t>& values) {
    return array_of<std::int32_t>("i4", {values.size()}, values);
}

NpyArray npy_text(const std::string& text) {
    return array_of<char>("u1", {text.size()}, std::vector<char>(text.begin(), text.end()));
}

Status write_npz(const std::string& path, const std::map<std::string, NpyArray>& arrays) {
    std::string file;
    std::string directory;
    for (const auto& [key, array] : arrays) {
        const std::string data = npy(array);
        const std::string name = key + ".npy";
        const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size());
        // From the version to the length of the extra field: the same in both headers.
        const std::string common = little(20, 2) + little(0, 2) + little(0, 2) + little(0, 4) +
                                   little(crc, 4) + little(data.size(), 4) +
                                   little(data.size(), 4) + little(name.size(), 2) + little(0, 2);
        directory += little(0x02014b50, 4) + little(20, 2) + common + little(0, 10) +
                     little(file.size(), 4) + name;
        file += little(0x04034b50, 4) + common + name + data;
    }
    const std::string end = little(0x06054b50, 4) + little(0, 4) + little(arrays.size(), 2) +
                            little(arrays.size(), 2) + little(directory.size(), 4) +
                            little(file.size(), 4) + little(0, 2);
    std::ofstream stream(path, std::ios::binary);
    stream << file << directory << end;
    stream.close();
    if (!stream) return error(Code::kInvalidArgument, "%s: cannot be written", path.c_str());
    return {};
}

}  // namespace splat::test
