#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>

#include "api/api_calls.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

/// Random weights of VGG16's and LPIPS's shapes in one .safetensors file (8 bytes of length, a JSON
/// header, the data).
std::string write_weights() {
    std::string header, data;
    const auto add = [&](const std::string& name, const std::vector<std::uint32_t>& dims,
                         const std::vector<float>& values) {
        std::string shape;
        for (const std::uint32_t extent : dims)
            shape += (shape.empty() ? "" : ",") + std::to_string(extent);
        header += (header.empty() ? "{\"" : ",\"") + name + R"(":{"dtype":"F32","shape":[)" +
                  shape + "],\"data_offsets\":[" + std::to_string(data.size()) + ",";
        data.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
        header += std::to_string(data.size()) + "]}";
    };
    const std::pair<std::uint32_t, std::uint32_t> layers[] = {
        {0, 64},   {2, 64},   {5, 128},  {7, 128},  {10, 256}, {12, 256}, {14, 256},
        {17, 512}, {19, 512}, {21, 512}, {24, 512}, {26, 512}, {28, 512}};
    std::uint32_t in = 3;
    for (const auto& [layer, out] : layers) {
        const std::string name = "features." + std::to_string(layer);
        // Variance 2 / (9 in): activations neither grow nor fade.
        add(name + ".weight", {out, in, 3, 3},
            normal_fill(std::size_t{9} * out * in, layer, 0, std::sqrt(2.0 / (9.0 * in))));
        add(name + ".bias", {out}, normal_fill(out, layer + 100, 0, 0.1));
        in = out;
    }
    const std::uint32_t channels[] = {64, 128, 256, 512, 512};
    for (std::uint32_t k = 0; k < 5; ++k)
        add("lin" + std::to_string(k) + ".model.1.weight", {1, channels[k], 1, 1},
            std::vector<float>(channels[k], 0.5F));
    header += "}";
    header.resize((header.size() + 7) / 8 * 8, ' ');
    const std::uint64_t length = header.size();
    std::string path = testing::TempDir() + "/api_lpips.safetensors";
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(&length), sizeof length);
    file << header << data;
    EXPECT_TRUE(file.good());
    return path;
}

/// Values against PyTorch's: tests/interop/lpips.py.
TEST(ApiLpips, IsADistance) {
    const std::string path = write_weights();
    Weights weights;
    ASSERT_DONE(splat_weights_load(path.c_str(), 0, weights.out()));
    const splat_weights given = weights;
    const Device device = open_device();
    auto desc = sized<splat_lpips_desc>();
    desc.weights = &given;
    desc.weight_count = 1;
    desc.side = 16;
    Lpips lpips;
    ASSERT_DONE(splat_lpips_create(device, &desc, lpips.out()));
    weights.destroy();
    std::filesystem::remove(path);

    const std::vector<float> a = normal_fill(3 * 16 * 16, 1, 0.5, 0.2);
    std::vector<float> near = a, far = a;
    const std::vector<float> noise = normal_fill(a.size(), 2);
    for (std::size_t i = 0; i < a.size(); ++i) {
        near[i] += 0.01F * noise[i];
        far[i] += 0.2F * noise[i];
    }
    const auto distance = [&](const std::vector<float>& x, const std::vector<float>& y) {
        double value = -1;
        EXPECT_DONE(splat_lpips_compare(lpips, x.data(), y.data(), &value));
        return value;
    };
    EXPECT_EQ(distance(a, a), 0);
    EXPECT_GT(distance(a, near), 0);
    EXPECT_GT(distance(a, far), distance(a, near));
    EXPECT_EQ(distance(a, far), distance(far, a));

    far[5] = std::numeric_limits<float>::quiet_NaN();
    double value = -1;
    EXPECT_REFUSED(splat_lpips_compare(lpips, a.data(), far.data(), &value),
                   SPLAT_ERROR_INVALID_ARGUMENT, "b holds nan at 5");
    EXPECT_EQ(value, -1) << "untouched";
}

}  // namespace
}  // namespace splat::test
