#pragma once

#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "io/bytes.h"

namespace splat::test {

/// componentType of glTF.
enum : int { kGltfByte = 5120, kGltfUbyte, kGltfShort, kGltfUshort, kGltfUint = 5125, kGltfFloat };

/// A glTF document of one mesh, whose members a test changes before it is written.
struct SampleGltf {
    io::Buffer bytes;  ///< the only buffer
    std::vector<std::string> views, accessors;
    std::map<std::string, int> attributes;
    std::string nodes = R"([{"mesh":0}])";
    std::string roots = "[0]";
    std::string primitive =
        R"("mode":0,"extensions":{"KHR_gaussian_splatting":{"kernel":"ellipse",)"
        R"("colorSpace":"srgb_rec709_display"}})";
    std::string used = R"("extensionsUsed":["KHR_gaussian_splatting"])";
    std::string more;       ///< further top-level members, each with a comma before it
    std::string mesh;       ///< further primitives, each with a comma before it
    std::string buffer;     ///< "uri":... of the buffer, with a comma before it
    long long length = -1;  ///< byteLength, if not that of the bytes

    /// `values` in a view and an accessor of their own, which the attribute names unless it is empty.
    template <class T>
    int add(const std::string& attribute, const std::vector<T>& values, int component,
            const std::string& type, std::size_t each, bool normalized = false) {
        const std::size_t start = bytes.size(), length_here = values.size() * sizeof(T);
        bytes.resize(start + (length_here + 3) / 4 * 4);
        if (length_here > 0) std::memcpy(bytes.data() + start, values.data(), length_here);
        views.push_back(R"({"buffer":0,"byteOffset":)" + std::to_string(start) +
                        R"(,"byteLength":)" + std::to_string(length_here) + "}");
        accessors.push_back(R"({"bufferView":)" + std::to_string(views.size() - 1) +
                            R"(,"componentType":)" + std::to_string(component) + R"(,"count":)" +
                            std::to_string(values.size() / each) + R"(,"type":")" + type + '"' +
                            (normalized ? R"(,"normalized":true})" : "}"));
        const int index = static_cast<int>(accessors.size()) - 1;
        if (!attribute.empty()) attributes[attribute] = index;
        return index;
    }

    [[nodiscard]] std::string json() const;
    [[nodiscard]] io::Buffer glb() const;  ///< with the bytes in a chunk
    [[nodiscard]] io::Buffer gltf()
        const;  ///< with the bytes in a data URI, unless `buffer` is set
};

std::string gltf_attribute(const std::string& name);  ///< with the prefix of the extension

/// Two Gaussians: means (1, 2, 3) and (4, 5, 6), scales 1 and 2, opacities 0.25 and 0.5, constant coefficients
/// 0.1 to 0.6; the second one is turned by 90 degrees about z.
SampleGltf sample_gltf();

/// A .glb of these chunks: type and bytes.
io::Buffer glb_of(const std::vector<std::pair<std::string, std::string>>& chunks,
                  std::uint32_t version = 2);

std::string base64(io::Bytes bytes);

}  // namespace splat::test
