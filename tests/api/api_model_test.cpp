// Models through the C API.
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "api/api_calls.h"
#include "api/raster_calls.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr std::size_t kModelSide = 16;
constexpr std::size_t kGaussians = kModelSide * kModelSide;

class ApiModel : public testing::Test {
  protected:
    void SetUp() override { device_ = open_device(); }

    std::vector<float> read(const Model& model, const char* name, std::size_t count) {
        std::vector<float> values(count);
        EXPECT_DONE(splat_model_read(model, name, values.data(), count * sizeof(float))) << name;
        return values;
    }
    void run(const Model& model) {
        auto input = sized<splat_model_input>();
        input.images = image_.data();
        EXPECT_DONE(splat_model_forward(model, &input));
    }
    std::string report(const Model& model) {
        std::size_t needed = 0;
        EXPECT_EQ(splat_model_report(model, nullptr, 0, &needed), SPLAT_INCOMPLETE);
        std::string text(needed, '\0');
        EXPECT_DONE(splat_model_report(model, text.data(), needed, nullptr));
        return text;
    }

    Device device_;
    std::vector<float> image_ = std::vector<float>(3 * kGaussians, 0.25F);
};

TEST_F(ApiModel, PredictsAScene) {
    const Model model = make_model(device_);
    ASSERT_DONE(splat_model_init(model, 3));
    run(model);
    const std::vector<float> means = read(model, "means", 3 * kGaussians);
    for (std::size_t i = 0; i < kGaussians; ++i) {  // between the planes of the configuration
        EXPECT_GT(means[3 * i + 2], 0.8F);
        EXPECT_LT(means[3 * i + 2], 1.8F);
    }
    Scene scene;
    ASSERT_DONE(splat_model_scene(model, 0, scene.out()));
    auto info = sized<splat_scene_info>();
    ASSERT_DONE(splat_scene_get_info(scene, &info));
    EXPECT_EQ(info.count, kGaussians);
    EXPECT_EQ(info.sh_degree, 1U);
    EXPECT_EQ(info.non_finite, 0U);
    EXPECT_NEAR(info.opacity_mean, 1 / (1 + std::exp(3.0)), 0.02) << "the bias of a fresh model";
    std::vector<float> scene_means(means.size());
    ASSERT_DONE(splat_scene_read(scene, "means", scene_means.data(), means.size() * sizeof(float)));
    EXPECT_EQ(scene_means, means);
    EXPECT_REFUSED(splat_model_scene(model, 1, scene.out()), SPLAT_ERROR_INVALID_ARGUMENT,
                   "object is 1, expected less than 1, the objects of the model");
}

TEST_F(ApiModel, WeightsWrittenInPlaceAreRefused) {
    const auto path =
        std::filesystem::temp_directory_path() / ("splat-model-" + std::to_string(::getpid()));
    write_large_weights(path);
    Weights weights;
    ASSERT_DONE(splat_weights_load(path.c_str(), 0, weights.out()));
    const Model model = make_model(device_);
    EXPECT_REFUSED(splat_model_load(model, weights, 0), SPLAT_ERROR_INVALID_ARGUMENT,
                   "it is of another network");
    std::filesystem::resize_file(path, 500000);
    const char* why = "was written since it was opened";
    for (const std::uint32_t flags : {0U, std::uint32_t{SPLAT_LOAD_GRAFT}})
        EXPECT_REFUSED(splat_model_load(model, weights, flags), SPLAT_ERROR_IO, why);
    auto desc = sized<splat_lpips_desc>();
    desc.side = 64;
    const splat_weights file = weights;
    desc.weights = &file;
    desc.weight_count = 1;
    splat_lpips lpips = nullptr;
    EXPECT_REFUSED(splat_lpips_create(device_, &desc, &lpips), SPLAT_ERROR_IO, why);
    std::filesystem::remove(path);
}

TEST_F(ApiModel, WeightsGoRound) {
    const Model first = make_model(device_);
    ASSERT_DONE(splat_model_init(first, 3));
    Weights weights;
    ASSERT_DONE(splat_model_store(first, weights.out()));
    const Model second = make_model(device_);
    ASSERT_DONE(splat_model_load(second, weights, 0));
    run(first);
    run(second);
    EXPECT_EQ(read(first, "raw", 24 * kGaussians), read(second, "raw", 24 * kGaussians));
    EXPECT_NE(report(second).find("\"left_out\": []"), std::string::npos) << report(second);

    splat_model_desc wide = model_desc();
    const std::string config = std::string(kSmallModel) + "\n  use_pred_depth: true";
    wide.config = config.c_str();
    Model more;
    ASSERT_DONE(splat_model_create(device_, &wide, more.out()));
    EXPECT_REFUSED(splat_model_load(more, weights, 0), SPLAT_ERROR_SHAPE_MISMATCH, "graft");
    ASSERT_DONE(splat_model_load(more, weights, SPLAT_LOAD_GRAFT));
    EXPECT_NE(
        report(more).find("\"widened\": [\"network_with_offset.encoder.enc.16x16_conv.weight\"]"),
        std::string::npos)
        << report(more);
}

TEST_F(ApiModel, ConfigurationChoosesWhatIsTrained) {
    splat_model_desc desc = model_desc();
    desc.flags = SPLAT_MODEL_GRADIENTS;
    const std::string config = std::string(kSmallModel) +
                               "\nopt: {lora_finetune: true, train_with_adapters: [out.], "
                               "freeze: [out.bias]}";
    desc.config = config.c_str();
    Model model;
    ASSERT_DONE(splat_model_create(device_, &desc, model.out()));
    ASSERT_DONE(splat_model_zero_gradients(model));
    EXPECT_EQ(read(model, "grad:network_with_offset.out.weight", 576),
              std::vector<float>(576, 0.0F));
    for (const char* name : {"grad:network_with_offset.out.bias",
                             "grad:network_with_offset.encoder.enc.16x16_conv.weight"})
        EXPECT_REFUSED(splat_model_read(model, name, image_.data(), 3000),
                       SPLAT_ERROR_INVALID_STATE, "the configuration does not train it");
    desc.flags = 0;
    Model inference;
    ASSERT_DONE(splat_model_create(device_, &desc, inference.out()));
    EXPECT_REFUSED(
        splat_model_read(inference, "grad:network_with_offset.out.weight", image_.data(), 3000),
        SPLAT_ERROR_INVALID_STATE, "made without SPLAT_MODEL_GRADIENTS");
    const std::string wrong = std::string(kSmallModel) + "\nopt: {freeze: [nothing]}";
    desc.config = wrong.c_str();
    EXPECT_REFUSED(splat_model_create(device_, &desc, model.out()), SPLAT_ERROR_INVALID_ARGUMENT,
                   "opt.freeze has 'nothing'");
}

TEST_F(ApiModel, AdaptersGoRoundAlone) {
    const std::string config = std::string(kSmallModel) +
                               "\nopt: {lora_finetune: true, lora_alpha: 2, batch_size: 2, "
                               "imgs_per_obj: 2, base_lr: 1e-2}";
    // B starts at zero: a step of training gives the adapters an effect.
    auto trainer_desc = sized<splat_trainer_desc>();
    trainer_desc.config = config.c_str();
    Trainer trainer;
    Model first;
    ASSERT_DONE(splat_trainer_create(device_, &trainer_desc, trainer.out()));
    ASSERT_DONE(splat_trainer_model(trainer, first.out()));
    ASSERT_DONE(splat_model_init(first, 3));
    const TrainerBatch numbers;
    const splat_trainer_batch batch = numbers.desc();
    auto info = sized<splat_trainer_info>();
    ASSERT_DONE(splat_trainer_step(trainer, &batch, &info));
    const std::string layer = "network_with_offset.encoder.enc.8x8_block0.proj.lora_";
    const std::vector<float> up = read(first, (layer + "B").c_str(), 64);
    ASSERT_NE(up, std::vector<float>(64, 0.0F));

    Weights adapters;
    ASSERT_DONE(splat_model_export(first, SPLAT_EXPORT_ADAPTERS, adapters.out()));
    std::uint32_t index = 0;
    EXPECT_DONE(
        splat_weights_find(adapters, ("base_model.model." + layer + "B.weight").c_str(), &index));
    splat_model_desc desc = model_desc();
    desc.config = config.c_str();
    Model second;
    ASSERT_DONE(splat_model_create(device_, &desc, second.out()));
    ASSERT_DONE(splat_model_init(second, 4));
    ASSERT_DONE(splat_model_load(second, adapters, SPLAT_LOAD_ADAPTERS));
    EXPECT_EQ(read(second, (layer + "B").c_str(), 64), up);
    const char* other = "network_with_offset.encoder.enc.16x16_conv.weight";
    EXPECT_NE(read(first, other, 216), read(second, other, 216));
    EXPECT_REFUSED(splat_model_load(first, adapters, 0), SPLAT_ERROR_INVALID_ARGUMENT,
                   "the file has no tensor");

    // The network with separate adapters (without dropout, unlike the trainer's), and three ways of
    // folding them.
    Weights state, exported, folded, folded_alone, unfolded;
    ASSERT_DONE(splat_model_store(first, state.out()));
    ASSERT_DONE(splat_model_load(second, state, 0));
    ASSERT_DONE(splat_model_export(first, SPLAT_EXPORT_MERGED, exported.out()));
    ASSERT_DONE(splat_weights_fold(state, nullptr, 2, 0, folded.out()));
    ASSERT_DONE(splat_weights_fold(state, adapters, 2, 0, folded_alone.out()));
    ASSERT_DONE(splat_weights_fold(folded, adapters, 2, SPLAT_FOLD_OUT, unfolded.out()));
    const Model plain = make_model(device_);
    const auto predict = [&](const Model& model) {
        run(model);
        return read(model, "raw", 24 * kGaussians);
    };
    const auto predict_with = [&](const Weights& weights) {
        EXPECT_DONE(splat_model_load(plain, weights, 0));
        return predict(plain);
    };
    const auto worst = [](const std::vector<float>& a, const std::vector<float>& b) {
        double most = 0;
        for (std::size_t i = 0; i < a.size(); ++i)
            most = std::max(most, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
        return most;
    };
    const std::vector<float> separate = predict(second);
    const std::vector<float> merged = predict_with(exported);
    EXPECT_LE(worst(separate, merged), 1e-6) << "float32 sums in another order, see splat.h";
    EXPECT_EQ(predict_with(folded), merged);
    EXPECT_EQ(predict_with(folded_alone), merged);
    EXPECT_GT(worst(predict_with(unfolded), merged), 1e-5) << "without adapters";
    EXPECT_REFUSED(splat_model_export(plain, SPLAT_EXPORT_MERGED, exported.out()),
                   SPLAT_ERROR_INVALID_STATE, "no adapters");
    EXPECT_REFUSED(splat_weights_fold(folded, nullptr, 2, 0, exported.out()),
                   SPLAT_ERROR_INVALID_ARGUMENT,
                   "adapters is NULL, and weights has no tensors '<layer>.lora_A'");
}

TEST_F(ApiModel, GradientsAddUp) {
    splat_model_desc desc = model_desc();
    desc.flags = SPLAT_MODEL_GRADIENTS;
    Model model;
    ASSERT_DONE(splat_model_create(device_, &desc, model.out()));
    ASSERT_DONE(splat_model_init(model, 3));
    ASSERT_DONE(splat_model_zero_gradients(model));
    run(model);
    const std::vector<float> ones(kGaussians, 1.0F);
    auto gradients = sized<splat_model_gradients>();
    gradients.opacities = ones.data();
    gradients.opacities_count = ones.size();
    ASSERT_DONE(splat_model_backward(model, &gradients));
    const char* name = "grad:network_with_offset.out.bias";
    const std::vector<float> once = read(model, name, 24);
    EXPECT_REFUSED(splat_model_backward(model, &gradients), SPLAT_ERROR_INVALID_STATE,
                   "run forward before each");
    run(model);
    ASSERT_DONE(splat_model_backward(model, &gradients));
    const std::vector<float> twice = read(model, name, 24);
    const std::vector<float> opacities = [&] { return read(model, "opacities", kGaussians); }();
    double expected = 0;  // the sum of sigmoid's derivative
    for (const float o : opacities)
        expected += static_cast<double>(o) * (1 - static_cast<double>(o));
    for (std::size_t i = 0; i < 24; ++i) {
        EXPECT_EQ(twice[i], 2 * once[i]) << i;
        EXPECT_NEAR(once[i], i == 4 ? expected : 0.0, 1e-5 * expected) << i;
    }
    const Model without = make_model(device_);
    run(without);
    EXPECT_REFUSED(splat_model_backward(without, &gradients), SPLAT_ERROR_INVALID_STATE,
                   "SPLAT_MODEL_GRADIENTS");
    std::vector<float> bias(24);
    EXPECT_DONE(splat_model_read(without, "network_with_offset.out.bias", bias.data(), 96));
}

/// The gradient by the images matches finite differences. Recomputing gives the same bits with less
/// memory.
TEST_F(ApiModel, GradientsOfInputs) {
    image_ =
        normal_fill(image_.size(), 4);  // the normalisations have no gradient for a constant image
    std::vector<float> results[2];
    std::uint64_t activations[2] = {};
    for (const bool recompute : {false, true}) {
        auto desc = model_desc();
        desc.flags = SPLAT_MODEL_INPUT_GRADIENTS;
        Model model;
        EXPECT_REFUSED(splat_model_create(device_, &desc, model.out()),
                       SPLAT_ERROR_INVALID_ARGUMENT, "need SPLAT_MODEL_GRADIENTS");
        desc.flags |= SPLAT_MODEL_GRADIENTS;
        if (recompute) desc.flags |= SPLAT_MODEL_RECOMPUTE;
        ASSERT_DONE(splat_model_create(device_, &desc, model.out()));
        ASSERT_DONE(splat_model_init(model, 3));
        std::vector<float>& gradient = results[recompute ? 1 : 0];
        gradient.resize(image_.size());
        const std::size_t bytes = gradient.size() * sizeof(float);
        EXPECT_REFUSED(splat_model_read(model, "grad:images", gradient.data(), bytes),
                       SPLAT_ERROR_INVALID_STATE, "call splat_model_backward first");
        run(model);
        const std::vector<float> ones(4 * kGaussians, 1);
        auto by_means = sized<splat_model_gradients>();
        by_means.means = ones.data();
        ASSERT_DONE(splat_model_backward(model, &by_means));
        EXPECT_REFUSED(splat_model_read(model, "grad:images", gradient.data(), bytes - 1),
                       SPLAT_ERROR_INVALID_ARGUMENT, "'grad:images' takes");
        EXPECT_REFUSED(splat_model_read(model, "grad:tokens", gradient.data(), bytes),
                       SPLAT_ERROR_INVALID_STATE, "no gradient of the tokens");
        ASSERT_DONE(splat_model_read(model, "grad:images", gradient.data(), bytes));
        EXPECT_REFUSED(splat_model_backward(model, &by_means), SPLAT_ERROR_INVALID_STATE,
                       "run forward before each");
        EXPECT_EQ(read(model, "grad:images", gradient.size()), gradient) << "still there";
        const std::string text = report(model);
        activations[recompute ? 1 : 0] =
            std::stoull(text.substr(text.find("\"activations\": ") + 15));
        const auto sum = [&](float step) {
            std::vector<float> moved = image_;
            for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += (i % 3 == 0 ? step : -step);
            image_.swap(moved);
            run(model);
            image_.swap(moved);
            double total = 0;
            for (const float mean : read(model, "means", 3 * kGaussians))
                total += static_cast<double>(mean);
            return total;
        };
        double expected = 0;
        for (std::size_t i = 0; i < gradient.size(); ++i)
            expected += static_cast<double>(i % 3 == 0 ? gradient[i] : -gradient[i]);
        const double measured = (sum(0.02F) - sum(-0.02F)) / 0.04;
        // Sums of 768 float32 numbers near 1 differ by 1e-5, over 0.04; and the network is not
        // linear.
        EXPECT_NEAR(measured, expected, 0.02 * std::abs(expected) + 1e-3);
    }
    EXPECT_EQ(results[0], results[1]);
    EXPECT_LT(activations[1], activations[0]);
    const Model without = make_model(device_);
    EXPECT_REFUSED(splat_model_read(without, "grad:images", results[0].data(), 4),
                   SPLAT_ERROR_INVALID_STATE, "without SPLAT_MODEL_INPUT_GRADIENTS");
}

TEST_F(ApiModel, BackwardIsOfTheParametersOfForward) {
    auto desc = model_desc();
    desc.flags = SPLAT_MODEL_GRADIENTS;
    Model model;
    ASSERT_DONE(splat_model_create(device_, &desc, model.out()));
    ASSERT_DONE(splat_model_init(model, 3));
    run(model);
    const auto nothing = sized<splat_model_gradients>();
    const char* const name = "network_with_offset.out.bias";
    const std::vector<float> bias = read(model, name, 24);
    ASSERT_DONE(splat_model_write(model, name, bias.data(), 96));
    EXPECT_REFUSED(splat_model_backward(model, &nothing), SPLAT_ERROR_INVALID_STATE,
                   "after parameters had changed");
    run(model);
    ASSERT_DONE(splat_model_backward(model, &nothing));
}

/// Optional lengths that a caller may give for a check, as pointers have none.
TEST_F(ApiModel, ComparesChannelsAndObjects) {
    const Model model = make_model(device_);
    auto input = sized<splat_model_input>();
    input.images = image_.data();
    input.channels = 3;
    input.objects = 1;
    EXPECT_DONE(splat_model_forward(model, &input));
    input.channels = 4;
    EXPECT_REFUSED(splat_model_forward(model, &input), SPLAT_ERROR_SHAPE_MISMATCH,
                   "splat_model_input.channels is 4, expected 3: RGB");
    input.channels = 0;
    input.objects = 2;
    EXPECT_REFUSED(splat_model_forward(model, &input), SPLAT_ERROR_SHAPE_MISMATCH,
                   "splat_model_input.objects is 2, expected 1");
    input.objects = 1;
    input.images_count = 10;
    EXPECT_REFUSED(splat_model_forward(model, &input), SPLAT_ERROR_SHAPE_MISMATCH,
                   "splat_model_input.images has 10 numbers, expected 768: [1, 3, 16, 16]");
    input.images_count = image_.size();
    input.focals_count = 2;
    EXPECT_REFUSED(splat_model_forward(model, &input), SPLAT_ERROR_INVALID_ARGUMENT,
                   "splat_model_input.focals is NULL, but focals_count is 2");
    input.focals_count = 0;
    EXPECT_DONE(splat_model_forward(model, &input));

    splat_model_desc desc = model_desc();
    const std::string config =
        std::string(kSmallModel) + "\n  use_pred_normal: true\n  use_mask: true";
    desc.config = config.c_str();
    Model more;
    ASSERT_DONE(splat_model_create(device_, &desc, more.out()));
    input = sized<splat_model_input>();
    input.images = image_.data();
    input.channels = 3;
    EXPECT_REFUSED(splat_model_forward(more, &input), SPLAT_ERROR_SHAPE_MISMATCH,
                   "channels is 3, expected 7: RGB, normal, mask");
}

/// Arrays that the configuration does not use are refused, and errors name those that it needs.
TEST_F(ApiModel, TakesTheArraysOfItsConfiguration) {
    const float numbers[256] = {1, 1};
    const auto check = [&](const char* keys, const float* splat_model_input::*array,
                           const char* missing, const char* unwanted) {
        splat_model_desc desc = model_desc();
        const std::string config = std::string(kSmallModel) + keys;
        desc.config = config.c_str();
        Model needs;
        ASSERT_DONE(splat_model_create(device_, &desc, needs.out()));
        auto input = sized<splat_model_input>();
        input.images = image_.data();
        EXPECT_REFUSED(splat_model_forward(needs, &input), SPLAT_ERROR_INVALID_ARGUMENT, missing);
        input.*array = numbers;
        EXPECT_DONE(splat_model_forward(needs, &input)) << keys;
        const Model plain = make_model(device_);
        EXPECT_REFUSED(splat_model_forward(plain, &input), SPLAT_ERROR_INVALID_ARGUMENT, unwanted);
    };
    check("\n  fov: 0", &splat_model_input::focals,
          "focals is NULL, expected 2 numbers for each image: the configuration has data.fov 0",
          "focals is given, expected NULL: the configuration has data.fov 51.9895");
    check("\n  custom_embedding: true\ncam_embd: {embedding: pose, dimension: 2}",
          &splat_model_input::embedding,
          "embedding is NULL, expected 12 numbers for each image: the configuration has a custom",
          "embedding is given, expected NULL: the configuration has no custom embedding");
    check("\nmodel.token_dim: 3\nmodel.tokens: 5", &splat_model_input::tokens,
          "tokens is NULL, expected 15 numbers for each image: the configuration has "
          "model.token_dim 3 and model.tokens 5",
          "tokens is given, expected NULL: the configuration has model.token_dim 0");
}

/// A refused call leaves what the last pass keeps for its backward pass.
TEST_F(ApiModel, ARefusedPassLeavesTheLastOnesGradients) {
    splat_model_desc desc = model_desc();
    desc.flags = SPLAT_MODEL_GRADIENTS;
    Model model;
    ASSERT_DONE(splat_model_create(device_, &desc, model.out()));
    ASSERT_DONE(splat_model_init(model, 3));
    const std::vector<float> ones(4 * kGaussians, 1.0F);
    auto gradients = sized<splat_model_gradients>();
    gradients.means = gradients.rotations = ones.data();
    const char* name = "grad:network_with_offset.encoder.enc.16x16_conv.weight";
    const auto backward = [&] {
        EXPECT_DONE(splat_model_backward(model, &gradients));
        return read(model, name, 216);
    };
    ASSERT_DONE(splat_model_zero_gradients(model));
    run(model);
    const std::vector<float> expected = backward();

    ASSERT_DONE(splat_model_zero_gradients(model));
    run(model);
    const std::vector<float> raw = read(model, "raw", 24 * kGaussians);
    const std::vector<float> other(3 * kGaussians, 0.75F);
    std::vector<float> pose(16, 0.0F);
    for (std::size_t i = 0; i < 4; ++i) pose[5 * i] = 1;
    pose[12] = 2;
    const float broken[4] = {1, 0, NAN, 0};
    auto input = sized<splat_model_input>();
    input.images = other.data();
    input.view_to_world = pose.data();
    input.quaternions = broken;
    EXPECT_REFUSED(splat_model_forward(model, &input), SPLAT_ERROR_INVALID_ARGUMENT,
                   "'quaternions' holds nan at 2");
    EXPECT_EQ(read(model, "raw", 24 * kGaussians), raw);

    // Neither do refused gradients, whichever they are.
    std::vector<float> not_finite = ones;
    not_finite[5] = INFINITY;
    splat_model_gradients wrong = gradients;
    wrong.opacities = ones.data();
    wrong.rotations = not_finite.data();
    EXPECT_REFUSED(splat_model_backward(model, &wrong), SPLAT_ERROR_INVALID_ARGUMENT,
                   "splat_model_gradients.rotations holds inf at 5");
    wrong = gradients;
    wrong.sh = ones.data();
    wrong.sh_count = 7;
    EXPECT_REFUSED(splat_model_backward(model, &wrong), SPLAT_ERROR_SHAPE_MISMATCH,
                   "splat_model_gradients.sh has 7 numbers, expected 3072: [1, 256, 4, 3]");
    EXPECT_EQ(backward(), expected);
}

/// In float32 sigmoid(20) is 1 and exp(-110) is 0. A scene's logits and logarithms stay finite, so
/// that a file keeps every Gaussian that is drawn.
TEST_F(ApiModel, ScenesOfExtremesAreFinite) {
    splat_model_desc desc = model_desc();
    desc.config =
        "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], attention_resolutions: [8],\n"
        "  opacity_bias: 20, scale_scale: 20, scale_bias: 1e-38}\n"
        "data: {training_resolution: 16}";
    Model model;
    ASSERT_DONE(splat_model_create(device_, &desc, model.out()));
    ASSERT_DONE(splat_model_init(model, 3));
    for (std::size_t i = 0; i < image_.size(); ++i) image_[i] = static_cast<float>(i % 7) - 3;
    run(model);
    const std::vector<float> opacities = read(model, "opacities", kGaussians);
    EXPECT_EQ(opacities, std::vector<float>(kGaussians, 1.0F));
    const std::vector<float> scales = read(model, "scales", 3 * kGaussians);
    EXPECT_GT(std::count(scales.begin(), scales.end(), 0.0F), 0) << "the case under test";
    Scene scene;
    ASSERT_DONE(splat_model_scene(model, 0, scene.out()));
    auto info = sized<splat_scene_info>();
    ASSERT_DONE(splat_scene_get_info(scene, &info));
    EXPECT_EQ(info.non_finite, 0U);
    EXPECT_EQ(info.opacity_mean, 1.0);
}

TEST_F(ApiModel, MeansOfTheCarsModelAreItsConfiguration) {
    splat_model_desc desc = model_desc();
    desc.config = nullptr;
    Model model;
    ASSERT_DONE(splat_model_create(device_, &desc, model.out()));
    EXPECT_NE(report(model).find("\"parameters\": 56378736"), std::string::npos);
}

}  // namespace
}  // namespace splat::test
