#include "io/scenes/sample_gltf.h"

#include "core/shown.h"

namespace splat::test {

std::string gltf_attribute(const std::string& name) {
    return "KHR_gaussian_splatting:" + name;
}

std::string SampleGltf::json() const {
    std::string named;
    for (const auto& [name, index] : attributes)
        named += (named.empty() ? "\"" : ",\"") + name + "\":" + std::to_string(index);
    const long long size = length < 0 ? static_cast<long long>(bytes.size()) : length;
    return R"({"asset":{"version":"2.0"},)" + used + R"(,"scene":0,"scenes":[{"nodes":)" + roots +
           R"(}],"nodes":)" + nodes + R"(,"meshes":[{"primitives":[{"attributes":{)" + named +
           "}," + primitive + "}" + mesh + R"(]}],"buffers":[{"byteLength":)" +
           std::to_string(size) + buffer + R"(}],"bufferViews":[)" + joined(views) +
           R"(],"accessors":[)" + joined(accessors) + "]" + more + "}";
}

io::Buffer SampleGltf::glb() const {
    return glb_of({{"JSON", json()}, {std::string("BIN\0", 4), std::string(io::as_text(bytes))}});
}

io::Buffer SampleGltf::gltf() const {
    SampleGltf with = *this;
    if (buffer.empty())
        with.buffer = R"(,"uri":"data:application/octet-stream;base64,)" + base64(bytes) + '"';
    io::Buffer file;
    io::put_text(file, with.json());
    return file;
}

SampleGltf sample_gltf() {
    SampleGltf sample;
    const float half = std::sqrt(0.5F);
    sample.add<float>("POSITION", {1, 2, 3, 4, 5, 6}, kGltfFloat, "VEC3", 3);
    sample.add<float>(gltf_attribute("ROTATION"), {0, 0, 0, 1, 0, 0, half, half}, kGltfFloat,
                      "VEC4", 4);
    sample.add<float>(gltf_attribute("SCALE"), {1, 1, 1, 2, 2, 2}, kGltfFloat, "VEC3", 3);
    sample.add<float>(gltf_attribute("OPACITY"), {0.25F, 0.5F}, kGltfFloat, "SCALAR", 1);
    sample.add<float>(gltf_attribute("SH_DEGREE_0_COEF_0"), {0.1F, 0.2F, 0.3F, 0.4F, 0.5F, 0.6F},
                      kGltfFloat, "VEC3", 3);
    return sample;
}

io::Buffer glb_of(const std::vector<std::pair<std::string, std::string>>& chunks,
                  std::uint32_t version) {
    io::Buffer body;
    for (const auto& [type, data] : chunks) {
        const std::string padding((4 - data.size() % 4) % 4, type == "JSON" ? ' ' : '\0');
        io::put(body, static_cast<std::uint32_t>(data.size() + padding.size()));
        io::put_text(body, type);
        io::put_text(body, data + padding);
    }
    io::Buffer file;
    io::put_text(file, "glTF");
    io::put(file, version);
    io::put(file, static_cast<std::uint32_t>(12 + body.size()));
    io::put_bytes(file, body);
    return file;
}

std::string base64(io::Bytes bytes) {
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    std::uint32_t held = 0;
    int bits = 0;
    for (const std::byte byte : bytes) {
        held = held << 8U | std::to_integer<std::uint32_t>(byte);
        for (bits += 8; bits >= 6; bits -= 6) text += digits[held >> (bits - 6) & 63U];
    }
    if (bits > 0) text += digits[held << (6 - bits) & 63U];
    return text.append((4 - text.size() % 4) % 4, '=');
}

}  // namespace splat::test
