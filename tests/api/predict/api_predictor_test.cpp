// Predictors through the C API.
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <numbers>

#include "api/predict/picture_calls.h"

namespace splat::test {
namespace {

using nlohmann::json;

Floats means_of(splat_scene scene) {
    const std::uint64_t count = got(splat_scene_get_info, scene).count;
    return floats_of(3 * count, splat_scene_read, scene, "means");
}

/// The weights of a small model, initialised at random.
Weights random_weights(const Device& device) {
    return got(splat_model_store, random_model(device));
}

class ApiPredictor : public testing::Test {
  protected:
    Device device_ = open_device();
    Predictor predictor_ = make_predictor(device_);
    std::vector<std::uint8_t> bytes_ = picture_bytes(3);
    splat_picture picture_{};

    void SetUp() override { picture_.image.pixels = image_of(bytes_, 3); }
    Floats predict(splat_predictor predictor, const splat_picture& picture) {
        Scene scene;
        EXPECT_DONE(splat_predictor_predict(predictor, &picture, 1, scene.out(), nullptr));
        return scene.get() == nullptr ? Floats() : means_of(scene);
    }
};

TEST_F(ApiPredictor, TellsWhatItTakes) {
    const auto info = got(splat_predictor_get_info, predictor_);
    EXPECT_EQ(info.views, 1U);
    EXPECT_EQ(info.resolution, 16U);
    EXPECT_EQ(info.channels, 3U);
    EXPECT_EQ(info.depth + info.normal + info.mask + info.origin_distance, 0U);
    EXPECT_EQ(info.gaussians, 256U);
    EXPECT_EQ(info.sh_degree, 1U);
    EXPECT_NEAR(info.fov_degrees, 51.99, 0.01);
    EXPECT_EQ(info.background[1], 1);
    EXPECT_STREQ(info.category, "");
    const json report = json::parse(text_of(splat_predictor_report, predictor_));
    EXPECT_EQ(report.at("weights"), "");
    EXPECT_TRUE(report.at("warnings").empty());
    EXPECT_FALSE(report.at("load").at("copied").empty());
    EXPECT_EQ(report.at("config").at("data").at("training_resolution"), 16);
}

TEST_F(ApiPredictor, AFileAndItsPixelsGiveTheSameScene) {
    const PictureFile file(3);
    const Floats means = predict(predictor_, picture_);
    EXPECT_GT(means.size(), 0U);
    splat_picture from_file{};
    from_file.image.path = file.path();
    EXPECT_EQ(predict(predictor_, from_file), means);
    EXPECT_EQ(predict(make_predictor(device_), picture_), means);
}

TEST_F(ApiPredictor, GivesFactsOfAPrediction) {
    splat_camera camera{};
    splat_picture_info info{};
    Floats inputs(3 * 256, -1);
    auto facts = sized<splat_prediction>();
    facts.cameras = &camera;
    facts.camera_capacity = 1;
    facts.pictures = &info;
    facts.picture_capacity = 1;
    facts.inputs = inputs.data();
    facts.input_capacity = inputs.size();
    picture_.focal = 100;
    Scene scene;
    ASSERT_DONE(splat_predictor_predict(predictor_, &picture_, 1, scene.out(), &facts));
    EXPECT_EQ(facts.camera_count, 1U);
    EXPECT_EQ(facts.picture_count, 1U);
    EXPECT_EQ(facts.gaussians + facts.faint + facts.not_finite, 256U);
    EXPECT_EQ(means_of(scene).size(), 3 * facts.gaussians);
    EXPECT_GT(facts.network_ms, 0);
    EXPECT_EQ(camera.width, 16U);
    EXPECT_NEAR(camera.fx, 8 / std::tan(51.98948897809546 / 2 * std::numbers::pi / 180), 1e-4);
    EXPECT_EQ(camera.world_to_camera[0], 1);
    EXPECT_EQ(info.found, SPLAT_FOUND_BY_BORDER);
    EXPECT_EQ(info.warnings, std::uint32_t{SPLAT_PICTURE_FIELD_OF_VIEW}) << "10 degrees";
    EXPECT_EQ(inputs[0], 1);
    EXPECT_LT(inputs[8 * 16 + 8], 0.5);
    const json report = json::parse(text_of(splat_prediction_report, &facts));
    EXPECT_EQ(report.at("gaussians"), facts.gaussians);
    EXPECT_EQ(report.at("pictures").at(0).at("mask"), "border");
    EXPECT_EQ(report.at("pictures").at(0).at("square").at(2), 18);
    EXPECT_EQ(report.at("pictures").at(0).at("warnings").size(), 1U);

    facts.input_capacity = 2;
    inputs.assign(inputs.size(), -1);
    EXPECT_EQ(splat_predictor_predict(predictor_, &picture_, 1, scene.out(), &facts),
              SPLAT_INCOMPLETE);
    EXPECT_EQ(inputs[1], 1);
    EXPECT_EQ(inputs[2], -1);
}

TEST_F(ApiPredictor, AReportOfNothingIsRefused) {
    splat_picture_info info{};
    auto facts = sized<splat_prediction>();
    facts.pictures = &info;
    facts.picture_capacity = facts.picture_count = 1;
    EXPECT_REFUSED(splat_prediction_report(&facts, nullptr, 0, nullptr), kArgument,
                   "prediction.pictures[0].found is 0");
}

TEST_F(ApiPredictor, TheFieldOfViewIsThatOfTheWeights) {
    const Predictor predictor = make_predictor(device_, random_model(device_, "\n  fov: 90"));
    EXPECT_NEAR(got(splat_predictor_get_info, predictor).fov_degrees, 90, 1e-3);
    splat_camera camera{};
    auto facts = sized<splat_prediction>();
    facts.cameras = &camera;
    facts.camera_capacity = 1;
    Scene scene;
    ASSERT_DONE(splat_predictor_predict(predictor, &picture_, 1, scene.out(), &facts));
    EXPECT_NEAR(camera.fx, 8, 1e-4);
}

TEST_F(ApiPredictor, APoseWithoutEffectIsRefused) {
    for (int i = 0; i < 4; ++i) picture_.world_to_camera[5 * i] = 1;
    Scene scene;
    EXPECT_REFUSED(splat_predictor_predict(predictor_, &picture_, 1, scene.out(), nullptr),
                   kArgument, "pictures[0]: a pose is given");
}

TEST_F(ApiPredictor, FindsTheConfigurationBesideItsWeights) {
    const Temporary folder;
    const std::string path = folder / "weights.safetensors";
    ASSERT_DONE(splat_weights_save(random_weights(device_), path.c_str(), 0));
    auto desc = sized<splat_predictor_desc>();
    desc.weights_path = path.c_str();
    Predictor made;
    EXPECT_REFUSED(splat_predictor_create(device_, &desc, made.out()), kNotFound,
                   "no config.json or config.yaml in the folder of");
    EXPECT_TRUE(holds(splat_last_error_message(), "fit no published configuration; the"));
    std::ofstream(folder / "config.yaml") << kSmallModel << "\n  category: cars\n";
    ASSERT_DONE(splat_predictor_create(device_, &desc, made.out()));
    EXPECT_EQ(predict(made, picture_), predict(predictor_, picture_));
    EXPECT_STREQ(got(splat_predictor_get_info, made).category, "cars");
}

/// The tensors by which the published networks are told apart.
Weights parts_of_nmr() {
    std::vector<std::pair<std::string, Dims>> parts = {
        {"network_with_offset.encoder.enc.64x64_conv.weight", {128, 3, 3, 3}},
        {"network_with_offset.out.weight", {24, 24, 1, 1}}};
    for (const int side : {64, 32, 16, 8})
        for (int block = 0; block < 4; ++block) {
            const std::string size = std::to_string(side);
            const std::string name = "network_with_offset.encoder.enc." + size + "x" + size +
                                     "_block" + std::to_string(block);
            const std::int64_t width = side == 64 ? 128 : 256;
            parts.push_back({name + ".norm0.weight", {width}});
            parts.push_back({name + ".conv1.bias", {width}});
            if (side == 8) parts.push_back({name + ".qkv.weight", {3 * width, width, 1, 1}});
        }
    const Floats zeros(std::size_t{768} * 256);
    std::vector<splat_named_array> arrays;
    for (const auto& [name, dims] : parts) {
        arrays.push_back(named_array(name.c_str(), zeros, dims));
        arrays.back().value_count = 1;
        for (const std::int64_t size : dims)
            arrays.back().value_count *= static_cast<std::uint64_t>(size);
    }
    return got(splat_weights_from_arrays, arrays.data(), arrays.size());
}

/// What parts_of_nmr() left out is missed before the device is used.
TEST_F(ApiPredictor, TakesThePublishedConfigurationThatFits) {
    const Temporary path(".safetensors");
    ASSERT_DONE(splat_weights_save(parts_of_nmr(), path.c_str(), 0));
    auto desc = sized<splat_predictor_desc>();
    desc.weights_path = path.c_str();
    Predictor made;
    const std::uint64_t before = got(splat_device_get_memory, device_).peak_bytes;
    EXPECT_REFUSED(splat_predictor_create(device_, &desc, made.out()), kFormat,
                   "the file has no tensor 'network_with_offset.encoder.enc.64x64_");
    EXPECT_EQ(got(splat_device_get_memory, device_).peak_bytes, before);
}

TEST_F(ApiPredictor, FoldsAdaptersIntoItsWeights) {
    const Model model =
        random_model(device_, "\nopt: {lora_finetune: true, lora_rank: 2, lora_alpha: 3}");
    const Weights adapters = got(splat_model_export, model, SPLAT_EXPORT_ADAPTERS);
    const Weights weights = random_weights(device_);
    const Weights folded = got(splat_weights_fold, weights, adapters, 3, 0);
    auto from = sized<splat_predictor_desc>();
    from.config = kSmallModel;
    from.weights = folded;
    const Predictor expected = got(splat_predictor_create, device_, from);
    from.weights = weights;
    from.adapters = adapters;
    const Predictor made = got(splat_predictor_create, device_, from);
    EXPECT_EQ(predict(made, picture_), predict(expected, picture_));
}

TEST_F(ApiPredictor, PredictsAnObjectOfADataSet) {
    const Dataset dataset = make_training_dataset();
    const std::uint32_t views[] = {1, 0};
    splat_camera cameras[2] = {};
    auto facts = sized<splat_prediction>();
    facts.cameras = cameras;
    facts.camera_capacity = 2;
    Scene scene;
    ASSERT_DONE(
        splat_predictor_predict_object(predictor_, dataset, 1, views, 2, scene.out(), &facts));
    EXPECT_EQ(facts.camera_count, 2U);
    EXPECT_EQ(facts.picture_count, 0U);
    EXPECT_EQ(cameras[0].world_to_camera[0], 1);
    EXPECT_NE(cameras[1].world_to_camera[0], 1);
    EXPECT_NEAR(cameras[1].fx, 131.25 / 8, 1e-6);
    // The same by the images of the data set.
    Floats image(3 * 256);
    auto out = sized<splat_dataset_views>();
    out.images = image.data();
    ASSERT_DONE(splat_dataset_read(dataset, 1, views, 1, &out));
    const Model model = random_model(device_);
    forward(model, image);
    const Scene expected = got(splat_model_scene, model, 0);
    ASSERT_DONE(splat_scene_filter(expected, SPLAT_FILTER_FINITE, 1.0 / 255));
    EXPECT_EQ(means_of(scene), means_of(expected));
    Scene none;
    EXPECT_REFUSED(
        splat_predictor_predict_object(predictor_, dataset, 9, views, 2, none.out(), nullptr),
        kArgument, "object is 9");
}

TEST_F(ApiPredictor, WeightsThatOverflowAreAnError) {
    const Model model = random_model(device_);
    constexpr const char* kWeight = "network_with_offset.encoder.enc.16x16_conv.weight";
    const Floats huge(216, 3.4e38F);
    ASSERT_DONE(splat_model_write(model, kWeight, huge.data(), huge.size() * 4));
    const Predictor made = make_predictor(device_, model);
    Scene scene;
    EXPECT_REFUSED(splat_predictor_predict(made, &picture_, 1, scene.out(), nullptr), kState,
                   "the network's output is not finite");
    EXPECT_EQ(scene.get(), nullptr);
}

TEST_F(ApiPredictor, TheBuiltInWeightsAreTheDefault) {
    const std::string path = text_of(splat_builtin_weights, nullptr);
    EXPECT_TRUE(path.ends_with("cars64/weights.safetensors")) << path;
    EXPECT_REFUSED(splat_builtin_weights("trucks", nullptr, 0, nullptr), kNotFound,
                   "expected cars64");
    const Predictor made = got(splat_predictor_create, device_, nullptr);
    EXPECT_EQ(got(splat_predictor_get_info, made).resolution, 64U);
}

TEST_F(ApiPredictor, BuiltInWeightsAreNamed) {
    Weights weights = got(splat_weights_load, "cars64-depth-normal", 0);
    EXPECT_REFUSED(splat_weights_load("trucks", 0, weights.out()), kNotFound,
                   "there is no file 'trucks'");
    auto desc = sized<splat_predictor_desc>();
    desc.weights_path = "cars64-depth-normal";
    Predictor made = got(splat_predictor_create, device_, &desc);
    const auto info = got(splat_predictor_get_info, made);
    EXPECT_EQ(info.depth + info.normal, 2U);
    desc.weights_path = "trucks";
    EXPECT_REFUSED(splat_predictor_create(device_, &desc, made.out()), kNotFound,
                   "expected cars64");
}

}  // namespace
}  // namespace splat::test
