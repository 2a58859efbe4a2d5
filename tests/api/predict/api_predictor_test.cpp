// Predictors through the C API.
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <functional>

#include "api/predict/picture_calls.h"

namespace splat::test {
namespace {

using nlohmann::json;

std::string text_of(const std::function<splat_result(char*, std::size_t, std::size_t*)>& get) {
    std::size_t needed = 0;
    EXPECT_EQ(get(nullptr, 0, &needed), SPLAT_INCOMPLETE);
    std::string text(needed, '\0');
    EXPECT_DONE(get(text.data(), needed, nullptr));
    text.pop_back();
    return text;
}

std::vector<float> means_of(splat_scene scene) {
    auto info = sized<splat_scene_info>();
    EXPECT_DONE(splat_scene_get_info(scene, &info));
    std::vector<float> means(3 * info.count);
    EXPECT_DONE(splat_scene_read(scene, "means", means.data(), means.size() * sizeof(float)));
    return means;
}

/// The weights of a small model, initialised at random.
Weights random_weights(const Device& device) {
    const Model model = make_model(device);
    EXPECT_DONE(splat_model_init(model, 3));
    Weights weights;
    EXPECT_DONE(splat_model_store(model, weights.out()));
    return weights;
}

class ApiPredictor : public testing::Test {
  protected:
    Device device_ = open_device();
    Predictor predictor_ = make_predictor(device_);
    std::vector<std::uint8_t> bytes_ = picture_bytes(3);
    splat_picture picture_{};

    void SetUp() override { picture_.image.pixels = image_of(bytes_, 3); }
    std::vector<float> predict(splat_predictor predictor, const splat_picture& picture) {
        Scene scene;
        EXPECT_DONE(splat_predictor_predict(predictor, &picture, 1, scene.out(), nullptr));
        return scene.get() == nullptr ? std::vector<float>() : means_of(scene);
    }
};

TEST_F(ApiPredictor, TellsWhatItTakes) {
    auto info = sized<splat_predictor_info>();
    ASSERT_DONE(splat_predictor_get_info(predictor_, &info));
    EXPECT_EQ(info.views, 1U);
    EXPECT_EQ(info.resolution, 16U);
    EXPECT_EQ(info.channels, 3U);
    EXPECT_EQ(info.depth + info.normal + info.mask + info.origin_distance, 0U);
    EXPECT_EQ(info.gaussians, 256U);
    EXPECT_EQ(info.sh_degree, 1U);
    EXPECT_NEAR(info.fov_degrees, 51.99, 0.01);
    EXPECT_EQ(info.background[1], 1);
    EXPECT_STREQ(info.category, "");
    const json report = json::parse(text_of([&](char* buffer, std::size_t size, std::size_t* n) {
        return splat_predictor_report(predictor_, buffer, size, n);
    }));
    EXPECT_EQ(report.at("weights"), "");
    EXPECT_TRUE(report.at("warnings").empty());
    EXPECT_FALSE(report.at("load").at("copied").empty());
    EXPECT_EQ(report.at("config").at("data").at("training_resolution"), 16);
}

TEST_F(ApiPredictor, AFileAndItsPixelsGiveTheSameScene) {
    const PictureFile file(3);
    const std::vector<float> means = predict(predictor_, picture_);
    EXPECT_GT(means.size(), 0U);
    splat_picture from_file{};
    from_file.image.path = file.path();
    EXPECT_EQ(predict(predictor_, from_file), means);
    EXPECT_EQ(predict(make_predictor(device_), picture_), means);
}

TEST_F(ApiPredictor, GivesFactsOfAPrediction) {
    splat_camera camera{};
    splat_picture_info info{};
    std::vector<float> inputs(3 * 256, -1);
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
    EXPECT_NEAR(camera.fx, 8 / std::tan(51.98948897809546 / 2 * M_PI / 180), 1e-4);
    EXPECT_EQ(camera.world_to_camera[0], 1);
    EXPECT_EQ(info.found, SPLAT_FOUND_BY_BORDER);
    EXPECT_EQ(info.warnings, std::uint32_t{SPLAT_PICTURE_FIELD_OF_VIEW}) << "10 degrees";
    EXPECT_EQ(inputs[0], 1);
    EXPECT_LT(inputs[8 * 16 + 8], 0.5);
    const json report = json::parse(text_of([&](char* buffer, std::size_t size, std::size_t* n) {
        return splat_prediction_report(&facts, buffer, size, n);
    }));
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
    EXPECT_REFUSED(splat_prediction_report(&facts, nullptr, 0, nullptr),
                   SPLAT_ERROR_INVALID_ARGUMENT, "prediction.pictures[0].found is 0");
}

TEST_F(ApiPredictor, TheFieldOfViewIsThatOfTheWeights) {
    const std::string wide = std::string(kSmallModel) + "\n  fov: 90";
    auto model_of_weights = model_desc();
    model_of_weights.config = wide.c_str();
    Model model;
    ASSERT_DONE(splat_model_create(device_, &model_of_weights, model.out()));
    ASSERT_DONE(splat_model_init(model, 3));
    const Predictor predictor = make_predictor(device_, model);
    auto info = sized<splat_predictor_info>();
    ASSERT_DONE(splat_predictor_get_info(predictor, &info));
    EXPECT_NEAR(info.fov_degrees, 90, 1e-3);
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
                   SPLAT_ERROR_INVALID_ARGUMENT, "pictures[0]: a pose is given");
}

TEST_F(ApiPredictor, FindsTheConfigurationBesideItsWeights) {
    const auto folder =
        std::filesystem::temp_directory_path() / ("splat_predictor_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    const std::string path = folder / "weights.safetensors";
    ASSERT_DONE(splat_weights_save(random_weights(device_), path.c_str(), 0));
    auto desc = sized<splat_predictor_desc>();
    desc.weights_path = path.c_str();
    Predictor made;
    EXPECT_REFUSED(splat_predictor_create(device_, &desc, made.out()), SPLAT_ERROR_NOT_FOUND,
                   "no config.json or config.yaml in the folder of");
    EXPECT_NE(std::string(splat_last_error_message()).find("fit no published configuration; the"),
              std::string::npos);
    std::ofstream(folder / "config.yaml") << kSmallModel << "\n  category: cars\n";
    ASSERT_DONE(splat_predictor_create(device_, &desc, made.out()));
    EXPECT_EQ(predict(made, picture_), predict(predictor_, picture_));
    auto info = sized<splat_predictor_info>();
    ASSERT_DONE(splat_predictor_get_info(made, &info));
    EXPECT_STREQ(info.category, "cars");
    std::filesystem::remove_all(folder);
}

/// The tensors by which the published networks are told apart.
Weights parts_of_nmr() {
    std::vector<std::pair<std::string, std::vector<std::int64_t>>> parts = {
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
    const std::vector<float> zeros(std::size_t{768} * 256);
    std::vector<splat_named_array> arrays;
    for (const auto& [name, dims] : parts) {
        splat_named_array array{};
        array.name = name.c_str();
        array.values = zeros.data();
        array.rank = static_cast<std::uint32_t>(dims.size());
        array.value_count = 1;
        for (std::size_t i = 0; i < dims.size(); ++i) {
            array.dims[i] = dims[i];
            array.value_count *= static_cast<std::uint64_t>(dims[i]);
        }
        arrays.push_back(array);
    }
    Weights weights;
    EXPECT_DONE(splat_weights_from_arrays(arrays.data(), arrays.size(), weights.out()));
    return weights;
}

/// With it the network is made, and loading then misses what parts_of_nmr() left out.
TEST_F(ApiPredictor, TakesThePublishedConfigurationThatFits) {
    const auto path = std::filesystem::temp_directory_path() /
                      ("splat_published_" + std::to_string(getpid()) + ".safetensors");
    ASSERT_DONE(splat_weights_save(parts_of_nmr(), path.c_str(), 0));
    auto desc = sized<splat_predictor_desc>();
    desc.weights_path = path.c_str();
    Predictor made;
    EXPECT_REFUSED(splat_predictor_create(device_, &desc, made.out()), SPLAT_ERROR_FORMAT,
                   "the file has no tensor 'network_with_offset.encoder.enc.64x64_");
    std::filesystem::remove(path);
}

TEST_F(ApiPredictor, FoldsAdaptersIntoItsWeights) {
    const std::string config =
        std::string("opt: {lora_finetune: true, lora_rank: 2, lora_alpha: 3}\n") + kSmallModel;
    splat_model_desc desc = model_desc();
    desc.config = config.c_str();
    Model model;
    ASSERT_DONE(splat_model_create(device_, &desc, model.out()));
    ASSERT_DONE(splat_model_init(model, 3));
    Weights adapters;
    ASSERT_DONE(splat_model_export(model, SPLAT_EXPORT_ADAPTERS, adapters.out()));
    const Weights weights = random_weights(device_);
    Weights folded;
    ASSERT_DONE(splat_weights_fold(weights, adapters, 3, 0, folded.out()));
    auto from = sized<splat_predictor_desc>();
    from.config = kSmallModel;
    from.weights = folded;
    Predictor expected, made;
    ASSERT_DONE(splat_predictor_create(device_, &from, expected.out()));
    from.weights = weights;
    from.adapters = adapters;
    ASSERT_DONE(splat_predictor_create(device_, &from, made.out()));
    EXPECT_EQ(predict(made, picture_), predict(expected, picture_));
}

TEST_F(ApiPredictor, PredictsAnObjectOfADataSet) {
    splat_dataset_desc desc = dataset_desc();
    desc.resolution = 16;
    for (float& value : desc.background) value = 1;
    Dataset dataset;
    ASSERT_DONE(splat_dataset_open(&desc, dataset.out()));
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
    std::vector<float> image(3 * 256);
    auto out = sized<splat_dataset_views>();
    out.images = image.data();
    ASSERT_DONE(splat_dataset_read(dataset, 1, views, 1, &out));
    auto input = sized<splat_model_input>();
    input.images = image.data();
    const Model model = make_model(device_);
    ASSERT_DONE(splat_model_init(model, 3));
    ASSERT_DONE(splat_model_forward(model, &input));
    Scene expected;
    ASSERT_DONE(splat_model_scene(model, 0, expected.out()));
    ASSERT_DONE(splat_scene_filter(expected, SPLAT_FILTER_FINITE, 1.0 / 255));
    EXPECT_EQ(means_of(scene), means_of(expected));
    Scene none;
    EXPECT_REFUSED(
        splat_predictor_predict_object(predictor_, dataset, 9, views, 2, none.out(), nullptr),
        SPLAT_ERROR_INVALID_ARGUMENT, "object is 9");
}

TEST_F(ApiPredictor, WeightsThatOverflowAreAnError) {
    const Model model = make_model(device_);
    ASSERT_DONE(splat_model_init(model, 3));
    std::string name;
    {
        Weights weights;
        ASSERT_DONE(splat_model_store(model, weights.out()));
        std::uint32_t count = 0;
        ASSERT_DONE(splat_weights_count(weights, &count));
        auto info = sized<splat_weights_info>();
        for (std::uint32_t i = 0; i < count && name.empty(); ++i) {
            ASSERT_DONE(splat_weights_get_info(weights, i, &info));
            if (info.rank != 4 || std::string(info.name).find("conv") == std::string::npos)
                continue;
            name = info.name;
            const std::vector<float> huge(info.elements, 3.4e38F);
            ASSERT_DONE(splat_model_write(model, info.name, huge.data(), huge.size() * 4));
        }
    }
    ASSERT_FALSE(name.empty());
    const Predictor made = make_predictor(device_, model);
    Scene scene;
    EXPECT_REFUSED(splat_predictor_predict(made, &picture_, 1, scene.out(), nullptr),
                   SPLAT_ERROR_INVALID_STATE, "the network's output is not finite");
    EXPECT_EQ(scene.get(), nullptr);
}

TEST_F(ApiPredictor, TheBuiltInWeightsAreTheDefault) {
    const std::string path = text_of([](char* buffer, std::size_t size, std::size_t* needed) {
        return splat_builtin_weights(nullptr, buffer, size, needed);
    });
    EXPECT_TRUE(path.ends_with("cars64/weights.safetensors")) << path;
    EXPECT_REFUSED(splat_builtin_weights("trucks", nullptr, 0, nullptr), SPLAT_ERROR_NOT_FOUND,
                   "expected cars64");
    Predictor made;
    ASSERT_DONE(splat_predictor_create(device_, nullptr, made.out()));
    auto info = sized<splat_predictor_info>();
    ASSERT_DONE(splat_predictor_get_info(made, &info));
    EXPECT_EQ(info.resolution, 64U);
}

TEST_F(ApiPredictor, BuiltInWeightsAreNamed) {
    Weights weights;
    ASSERT_DONE(splat_weights_load("cars64-depth-normal", 0, weights.out()));
    EXPECT_REFUSED(splat_weights_load("trucks", 0, weights.out()), SPLAT_ERROR_NOT_FOUND,
                   "there is no file 'trucks'");
    auto desc = sized<splat_predictor_desc>();
    desc.weights_path = "cars64-depth-normal";
    Predictor made;
    ASSERT_DONE(splat_predictor_create(device_, &desc, made.out()));
    auto info = sized<splat_predictor_info>();
    ASSERT_DONE(splat_predictor_get_info(made, &info));
    EXPECT_EQ(info.depth + info.normal, 2U);
    desc.weights_path = "trucks";
    EXPECT_REFUSED(splat_predictor_create(device_, &desc, made.out()), SPLAT_ERROR_NOT_FOUND,
                   "expected cars64");
}

}  // namespace
}  // namespace splat::test
