// Weights of MoGe-2 as a prior model, through the C API. Needs a device, and no ONNX Runtime.

#include <cmath>

#include "api/api_calls.h"
#include "io/weights_file.h"
#include "vision/small_moge.h"

namespace splat::test {
namespace {

constexpr const char* kPreset = "moge-2-vits-normal";
constexpr std::uint32_t kWidth = 24, kHeight = 16, kPixels = kWidth * kHeight;

std::string saved(const io::NamedTensors& tensors, const char* name) {
    const std::string path = testing::TempDir() + name;
    io::WeightsFile file;
    file.tensors = tensors;
    EXPECT_TRUE(io::save_weights(file, path).ok());
    return path;
}

splat_prior_model_desc weights_desc(const std::string& path, splat_device device) {
    auto desc = sized<splat_prior_model_desc>();
    desc.preset = kPreset;
    desc.model_path = path.c_str();
    desc.tokens = 24;
    desc.device = device;
    return desc;
}

std::vector<std::uint8_t> wavy_bytes() {
    std::vector<std::uint8_t> bytes;
    for (std::uint32_t i = 0; i < 3 * kPixels; ++i)
        bytes.push_back(static_cast<std::uint8_t>(120 + 100 * std::sin(0.37 * i)));
    return bytes;
}

TEST(ApiWeightsModel, MakesAllMapsAndTheFocalLengthInOnePass) {
    const std::string path = saved(small_moge(), "api_moge.safetensors");
    PriorModel model;
    {
        const Device device = open_device();
        const auto desc = weights_desc(path, device.get());
        EXPECT_DONE(splat_prior_model_create(&desc, model.out()));
    }  // the model keeps the device open
    const auto info = got(splat_prior_model_get_info, model);
    EXPECT_EQ(info.maps, 7U);
    EXPECT_STREQ(info.preset, kPreset);
    EXPECT_STREQ(info.runtime_version, "");
    EXPECT_TRUE(holds(info.path, "api_moge.safetensors"));
    std::vector<std::uint8_t> rgb = wavy_bytes();
    const splat_image picture = packed_image(rgb, kWidth, kHeight, 3);
    Floats depth(kPixels), normal(3 * kPixels), mask(kPixels), alone(3 * kPixels);
    splat_prior_maps maps = {packed_image(depth, kWidth, kHeight, 1),
                             packed_image(normal, kWidth, kHeight, 3),
                             packed_image(mask, kWidth, kHeight, 1)};
    double focal = -1;
    EXPECT_DONE(splat_prior_model_run_focal(model, &picture, &maps, &focal, 1));
    EXPECT_TRUE(focal > 0 && std::isfinite(focal));
    // Random points lie far away, so that the range of 1 / distance is near the map's epsilon.
    EXPECT_EQ(*std::min_element(depth.begin(), depth.end()), 0);
    EXPECT_GT(*std::max_element(depth.begin(), depth.end()), 0);
    for (std::size_t i = 0; i < kPixels; ++i) {
        double length = 0;
        for (std::size_t c = 0; c < 3; ++c) length += std::pow(2 * normal[3 * i + c] - 1, 2);
        EXPECT_NEAR(length, 1, 1e-5);
        EXPECT_TRUE(mask[i] == 0 || mask[i] == 1);
    }
    maps = {};
    maps.normal = packed_image(alone, kWidth, kHeight, 3);
    EXPECT_DONE(splat_prior_model_run(model, &picture, &maps, 1));
    EXPECT_EQ(alone, normal);
    // The focal length alone.
    double again = -1;
    maps = {};
    EXPECT_DONE(splat_prior_model_run_focal(model, &picture, &maps, &again, 1));
    EXPECT_EQ(again, focal);
    EXPECT_REFUSED(splat_prior_model_run(model, &picture, &maps, 1), kArgument, "no map");
}

/// No camera sees the small model's points; one sees them mirrored.
TEST(ApiWeightsModel, WarnsOfAFocalLengthThatIsAGuess) {
    io::NamedTensors tensors = small_moge();
    const std::string layer = "points_head.output_blocks.4.";
    for (const char* name : {"weight", "bias"}) {
        io::NamedTensor changed = *tensors.find(layer + name);
        std::vector<float> values(changed.values.begin(), changed.values.end());
        for (std::size_t i = 0; i < values.size() / 3 * 2; ++i) values[i] = -values[i];
        changed.values = values;
        tensors = with(tensors, std::move(changed));
    }
    const Device device = open_device();
    const std::vector<std::uint8_t> rgb = wavy_bytes();
    const splat_image picture = packed_image(rgb, kWidth, kHeight, 3);
    const splat_prior_maps maps{};
    const auto run = [&](const std::string& path) {
        const auto desc = weights_desc(path, device.get());
        const PriorModel model = got(splat_prior_model_create, &desc);
        std::string said;
        const auto hear = [](void* user, splat_log_level, const char* message) {
            *static_cast<std::string*>(user) += message;
        };
        EXPECT_DONE(splat_log_set_callback(hear, &said, SPLAT_LOG_WARNING));
        double focal = 0;
        EXPECT_DONE(splat_prior_model_run_focal(model, &picture, &maps, &focal, 1));
        listen_to_log();
        return std::pair(focal, said);
    };
    const auto [focal, said] = run(saved(small_moge(), "api_unseen.safetensors"));
    EXPECT_NEAR(focal, kWidth / 2 * std::sqrt(3.0), 1e-6) << "60 degrees";
    EXPECT_TRUE(holds(said, "pictures[0]: no camera sees the points that"));
    const auto [seen, nothing] = run(saved(tensors, "api_mirrored.safetensors"));
    EXPECT_NE(seen, focal);
    EXPECT_EQ(nothing, "");
}

TEST(ApiWeightsModel, SaysWhatIsWrong) {
    const Device device = open_device();
    const std::string good = saved(small_moge(), "api_moge_good.pth");
    PriorModel model;
    const auto refused = [&](const std::string& path, splat_result code, const char* part,
                             const auto& change) {
        auto desc = weights_desc(path, device.get());
        change(desc);
        EXPECT_REFUSED(splat_prior_model_create(&desc, model.out()), code, part);
    };
    const auto as_it_is = [](auto&) {};
    refused(good, kArgument, "device is NULL, but '", [](auto& d) { d.device = nullptr; });
    refused(good, kArgument, "preset 'u2net'", [](auto& d) { d.preset = "u2net"; });
    const io::NamedTensors song =
        with({}, {"network_with_offset.out.weight", {1}, io::NumberType::kF32, {1.0F}});
    const std::uint64_t before = got(splat_device_get_memory, device).peak_bytes;
    refused(saved(song, "api_song.safetensors"), kFormat, "they look like a SongUNet", as_it_is);
    refused(saved(without(small_moge(), "encoder.backbone.norm.bias"), "api_less.safetensors"),
            kFormat, "api_less.safetensors': 1 of the network's", as_it_is);
    EXPECT_EQ(got(splat_device_get_memory, device).peak_bytes, before) << "not even tested";
    // Without normals the preset's output is not there.
    refused(saved(small_moge(false), "api_no_normal.safetensors"), kFormat, "expects 'normal'",
            as_it_is);
    const auto desc = weights_desc(good, device.get());
    EXPECT_DONE(splat_prior_model_create(&desc, model.out()));
}

/// By the shapes alone. The rest of the tensors is smaller than those of the preset.
TEST(ApiWeightsModel, TheReportNamesThePreset) {
    io::NamedTensors tensors = small_moge();
    const auto add = [&](const std::string& name, std::vector<std::int64_t> dims) {
        std::int64_t count = 1;
        for (const std::int64_t dim : dims) count *= dim;
        const std::vector<float> values(static_cast<std::size_t>(count));
        tensors = with(tensors,
                       {"encoder.backbone." + name, std::move(dims), io::NumberType::kF32, values});
    };
    const auto report = [&] {
        const std::string path = saved(tensors, "api_moge_report.safetensors");
        return text_of(splat_weights_report, got(splat_weights_load, path.c_str(), 0));
    };
    EXPECT_TRUE(holds(report(), "they look like MoGe-2\"")) << report();
    add("patch_embed.proj.weight", {384, 3, 14, 14});
    add("pos_embed", {1, 26, 384});
    for (int i = 2; i < 12; ++i) add("blocks." + std::to_string(i) + ".norm1.weight", {384});
    EXPECT_TRUE(holds(report(), "look like MoGe-2, of the preset moge-2-vits-normal")) << report();
}

}  // namespace
}  // namespace splat::test
