// Models through the C API.
#include <cmath>
#include <filesystem>

#include "api/api_calls.h"
#include "api/raster_calls.h"
#include "support/rng_fill.h"
#include "support/system.h"

namespace splat::test {
namespace {

constexpr std::size_t kModelSide = 16;
constexpr std::size_t kGaussians = kModelSide * kModelSide;

class ApiModel : public testing::Test {
  protected:
    static Floats read(splat_model model, const std::string& name, std::size_t count) {
        return floats_of(count, splat_model_read, model, name.c_str());
    }
    static Floats raw(splat_model model) { return read(model, "raw", 24 * kGaussians); }
    static std::string report(splat_model model) { return text_of(splat_model_report, model); }
    void run(splat_model model) { forward(model, image_); }

    Device device_ = open_device();
    Floats image_ = Floats(3 * kGaussians, 0.25F);
};

TEST_F(ApiModel, PredictsAScene) {
    const Model model = random_model(device_);
    run(model);
    const Floats means = read(model, "means", 3 * kGaussians);
    for (std::size_t i = 0; i < kGaussians; ++i) {  // between the planes of the configuration
        EXPECT_GT(means[3 * i + 2], 0.8F);
        EXPECT_LT(means[3 * i + 2], 1.8F);
    }
    Scene scene = got(splat_model_scene, model, 0);
    const auto info = got(splat_scene_get_info, scene);
    EXPECT_EQ(info.count, kGaussians);
    EXPECT_EQ(info.sh_degree, 1U);
    EXPECT_EQ(info.non_finite, 0U);
    EXPECT_NEAR(info.opacity_mean, 1 / (1 + std::exp(3.0)), 0.02) << "the bias of a fresh model";
    Floats scene_means = floats_of(means.size(), splat_scene_read, scene, "means");
    EXPECT_EQ(scene_means, means);
    EXPECT_REFUSED(splat_model_scene(model, 1, scene.out()), kArgument,
                   "object is 1, expected less than 1, the objects of the model");
}

TEST_F(ApiModel, WeightsWrittenInPlaceAreRefused) {
    SPLAT_NEED_WRITES_TO_MAPPED_FILES();
    const Temporary path;
    write_large_weights(path.path());
    const Weights weights = got(splat_weights_load, path.c_str(), 0);
    const Model model = make_model(device_);
    EXPECT_REFUSED(splat_model_load(model, weights, 0), kArgument,
                   "the weights are of another network than the configuration's");
    std::filesystem::resize_file(path.path(), 500000);
    const char* why = "was written since it was opened";
    for (const std::uint32_t flags : {0U, std::uint32_t{SPLAT_LOAD_GRAFT}})
        EXPECT_REFUSED(splat_model_load(model, weights, flags), kIo, why);
    auto desc = sized<splat_lpips_desc>();
    desc.side = 64;
    const splat_weights file = weights;
    desc.weights = &file;
    desc.weight_count = 1;
    splat_lpips lpips = nullptr;
    EXPECT_REFUSED(splat_lpips_create(device_, &desc, &lpips), kIo, why);
}

TEST_F(ApiModel, WeightsGoRound) {
    const Model first = random_model(device_);
    const Weights weights = got(splat_model_store, first);
    const Model second = make_model(device_);
    ASSERT_DONE(splat_model_load(second, weights, 0));
    run(first);
    run(second);
    EXPECT_EQ(raw(first), raw(second));
    EXPECT_TRUE(holds(report(second), "\"left_out\": []"));

    const Model more = make_model(device_, "\n  use_pred_depth: true");
    EXPECT_REFUSED(splat_model_load(more, weights, 0), kShape, "graft");
    ASSERT_DONE(splat_model_load(more, weights, SPLAT_LOAD_GRAFT));
    EXPECT_TRUE(holds(report(more),
                      "\"widened\": [\"network_with_offset.encoder.enc.16x16_conv.weight\"]"));
}

TEST_F(ApiModel, ConfigurationChoosesWhatIsTrained) {
    constexpr const char* kKeys =
        "\nopt: {lora_finetune: true, train_with_adapters: [out.], freeze: [out.bias]}";
    Model model = make_model(device_, kKeys, SPLAT_MODEL_GRADIENTS);
    ASSERT_DONE(splat_model_zero_gradients(model));
    EXPECT_EQ(read(model, "grad:network_with_offset.out.weight", 576), Floats(576, 0.0F));
    for (const char* name : {"grad:network_with_offset.out.bias",
                             "grad:network_with_offset.encoder.enc.16x16_conv.weight"})
        EXPECT_REFUSED(splat_model_read(model, name, image_.data(), 3000), kState,
                       "the configuration does not train it");
    const Model inference = make_model(device_, kKeys);
    EXPECT_REFUSED(
        splat_model_read(inference, "grad:network_with_offset.out.weight", image_.data(), 3000),
        kState, "made without SPLAT_MODEL_GRADIENTS");
    splat_model_desc desc = model_desc();
    const std::string wrong = std::string(kSmallModel) + "\nopt: {freeze: [nothing]}";
    desc.config = wrong.c_str();
    EXPECT_REFUSED(splat_model_create(device_, &desc, model.out()), kArgument,
                   "opt.freeze has 'nothing'");
}

TEST_F(ApiModel, AdaptersGoRoundAlone) {
    const std::string keys =
        "\nopt: {lora_finetune: true, lora_alpha: 2, batch_size: 2, imgs_per_obj: 2, base_lr: "
        "1e-2}";
    const std::string config = kSmallModel + keys;
    // B starts at zero: a step of training gives the adapters an effect.
    auto trainer_desc = sized<splat_trainer_desc>();
    trainer_desc.config = config.c_str();
    const Trainer trainer = got(splat_trainer_create, device_, trainer_desc);
    const Model first = got(splat_trainer_model, trainer);
    ASSERT_DONE(splat_model_init(first, 3));
    const TrainerBatch numbers;
    got(splat_trainer_step, trainer, numbers.desc());
    const std::string layer = "network_with_offset.encoder.enc.8x8_block0.proj.lora_";
    const Floats up = read(first, layer + "B", 64);
    ASSERT_NE(up, Floats(64, 0.0F));

    const Weights adapters = got(splat_model_export, first, SPLAT_EXPORT_ADAPTERS);
    got(splat_weights_find, adapters, ("base_model.model." + layer + "B.weight").c_str());
    const Model second = make_model(device_, keys);
    ASSERT_DONE(splat_model_init(second, 4));
    ASSERT_DONE(splat_model_load(second, adapters, SPLAT_LOAD_ADAPTERS));
    EXPECT_EQ(read(second, layer + "B", 64), up);
    const char* other = "network_with_offset.encoder.enc.16x16_conv.weight";
    EXPECT_NE(read(first, other, 216), read(second, other, 216));
    EXPECT_REFUSED(splat_model_load(first, adapters, 0), kArgument,
                   "and they look like low-rank adapters");

    // The network with separate adapters (without dropout, unlike the trainer's), and three ways of
    // folding them.
    const Weights state = got(splat_model_store, first);
    ASSERT_DONE(splat_model_load(second, state, 0));
    Weights exported = got(splat_model_export, first, SPLAT_EXPORT_MERGED);
    const Weights folded = got(splat_weights_fold, state, nullptr, 2, 0);
    const Weights folded_alone = got(splat_weights_fold, state, adapters, 2, 0);
    const Weights unfolded = got(splat_weights_fold, folded, adapters, 2, SPLAT_FOLD_OUT);
    const Model plain = make_model(device_);
    const auto predict = [&](const Model& model) {
        run(model);
        return raw(model);
    };
    const auto predict_with = [&](const Weights& weights) {
        EXPECT_DONE(splat_model_load(plain, weights, 0));
        return predict(plain);
    };
    const auto worst = [](const Floats& a, const Floats& b) {
        double most = 0;
        for (std::size_t i = 0; i < a.size(); ++i)
            most = std::max(most, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
        return most;
    };
    const Floats separate = predict(second);
    const Floats merged = predict_with(exported);
    EXPECT_LE(worst(separate, merged), 1e-6) << "float32 sums in another order, see splat.h";
    EXPECT_EQ(predict_with(folded), merged);
    EXPECT_EQ(predict_with(folded_alone), merged);
    EXPECT_GT(worst(predict_with(unfolded), merged), 1e-5) << "without adapters";
    EXPECT_REFUSED(splat_model_export(plain, SPLAT_EXPORT_MERGED, exported.out()), kState,
                   "no adapters");
    EXPECT_REFUSED(splat_weights_fold(folded, nullptr, 2, 0, exported.out()), kArgument,
                   "adapters is NULL, and weights has no tensors '<layer>.lora_A'");
}

TEST_F(ApiModel, GradientsAddUp) {
    const Model model = random_model(device_, "", SPLAT_MODEL_GRADIENTS);
    ASSERT_DONE(splat_model_zero_gradients(model));
    run(model);
    const Floats ones(kGaussians, 1.0F);
    auto gradients = sized<splat_model_gradients>();
    gradients.opacities = ones.data();
    gradients.opacities_count = ones.size();
    ASSERT_DONE(splat_model_backward(model, &gradients));
    const char* name = "grad:network_with_offset.out.bias";
    const Floats once = read(model, name, 24);
    EXPECT_REFUSED(splat_model_backward(model, &gradients), kState, "run forward before each");
    run(model);
    ASSERT_DONE(splat_model_backward(model, &gradients));
    const Floats twice = read(model, name, 24);
    double expected = 0;  // the sum of sigmoid's derivative
    for (const float o : read(model, "opacities", kGaussians))
        expected += static_cast<double>(o) * (1 - static_cast<double>(o));
    for (std::size_t i = 0; i < 24; ++i) {
        EXPECT_EQ(twice[i], 2 * once[i]) << i;
        EXPECT_NEAR(once[i], i == 4 ? expected : 0.0, 1e-5 * expected) << i;
    }
    const Model without = make_model(device_);
    run(without);
    EXPECT_REFUSED(splat_model_backward(without, &gradients), kState, "SPLAT_MODEL_GRADIENTS");
    read(without, "network_with_offset.out.bias", 24);
}

/// The gradient by the images matches finite differences. Recomputing gives the same bits with less
/// memory.
TEST_F(ApiModel, GradientsOfInputs) {
    image_ =
        normal_fill(image_.size(), 4);  // the normalisations have no gradient for a constant image
    Floats results[2];
    std::uint64_t activations[2] = {};
    for (const bool recompute : {false, true}) {
        auto desc = model_desc();
        desc.flags = SPLAT_MODEL_INPUT_GRADIENTS;
        Model model;
        EXPECT_REFUSED(splat_model_create(device_, &desc, model.out()), kArgument,
                       "need SPLAT_MODEL_GRADIENTS");
        desc.flags |= SPLAT_MODEL_GRADIENTS;
        if (recompute) desc.flags |= SPLAT_MODEL_RECOMPUTE;
        ASSERT_DONE(splat_model_create(device_, &desc, model.out()));
        ASSERT_DONE(splat_model_init(model, 3));
        Floats& gradient = results[recompute ? 1 : 0];
        gradient.resize(image_.size());
        const std::size_t bytes = gradient.size() * sizeof(float);
        EXPECT_REFUSED(splat_model_read(model, "grad:images", gradient.data(), bytes), kState,
                       "call splat_model_backward first");
        run(model);
        const Floats ones(4 * kGaussians, 1);
        auto by_means = sized<splat_model_gradients>();
        by_means.means = ones.data();
        ASSERT_DONE(splat_model_backward(model, &by_means));
        EXPECT_REFUSED(splat_model_read(model, "grad:images", gradient.data(), bytes - 1),
                       kArgument, "'grad:images' takes");
        EXPECT_REFUSED(splat_model_read(model, "grad:tokens", gradient.data(), bytes), kState,
                       "no gradient of the tokens");
        ASSERT_DONE(splat_model_read(model, "grad:images", gradient.data(), bytes));
        EXPECT_REFUSED(splat_model_backward(model, &by_means), kState, "run forward before each");
        EXPECT_EQ(read(model, "grad:images", gradient.size()), gradient) << "still there";
        const std::string text = report(model);
        activations[recompute ? 1 : 0] =
            std::stoull(text.substr(text.find("\"activations\": ") + 15));
        const auto sum = [&](float step) {
            Floats moved = image_;
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
    EXPECT_REFUSED(splat_model_read(without, "grad:images", results[0].data(), 4), kState,
                   "without SPLAT_MODEL_INPUT_GRADIENTS");
}

TEST_F(ApiModel, BackwardIsOfTheParametersOfForward) {
    const Model model = random_model(device_, "", SPLAT_MODEL_GRADIENTS);
    run(model);
    const auto nothing = sized<splat_model_gradients>();
    const char* const name = "network_with_offset.out.bias";
    const Floats bias = read(model, name, 24);
    ASSERT_DONE(splat_model_write(model, name, bias.data(), 96));
    EXPECT_REFUSED(splat_model_backward(model, &nothing), kState, "after parameters had changed");
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
    EXPECT_REFUSED(splat_model_forward(model, &input), kShape,
                   "splat_model_input.channels is 4, expected 3: RGB");
    input.channels = 0;
    input.objects = 2;
    EXPECT_REFUSED(splat_model_forward(model, &input), kShape,
                   "splat_model_input.objects is 2, expected 1");
    input.objects = 1;
    input.images_count = 10;
    EXPECT_REFUSED(splat_model_forward(model, &input), kShape,
                   "splat_model_input.images has 10 numbers, expected 768: [1, 3, 16, 16]");
    input.images_count = image_.size();
    input.focals_count = 2;
    EXPECT_REFUSED(splat_model_forward(model, &input), kArgument,
                   "splat_model_input.focals is NULL, but focals_count is 2");
    input.focals_count = 0;
    EXPECT_DONE(splat_model_forward(model, &input));

    const Model more = make_model(device_, "\n  use_pred_normal: true\n  use_mask: true");
    input = sized<splat_model_input>();
    input.images = image_.data();
    input.channels = 3;
    EXPECT_REFUSED(splat_model_forward(more, &input), kShape,
                   "channels is 3, expected 7: RGB, normal, mask");
}

/// Arrays that the configuration does not use are refused, and errors name those that it needs.
TEST_F(ApiModel, TakesTheArraysOfItsConfiguration) {
    const float numbers[256] = {1, 1};
    const auto check = [&](const char* keys, const float* splat_model_input::*array,
                           const char* missing, const char* unwanted) {
        const Model needs = make_model(device_, keys);
        auto input = sized<splat_model_input>();
        input.images = image_.data();
        EXPECT_REFUSED(splat_model_forward(needs, &input), kArgument, missing);
        input.*array = numbers;
        EXPECT_DONE(splat_model_forward(needs, &input)) << keys;
        const Model plain = make_model(device_);
        EXPECT_REFUSED(splat_model_forward(plain, &input), kArgument, unwanted);
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
    const Model model = random_model(device_, "", SPLAT_MODEL_GRADIENTS);
    const Floats ones(4 * kGaussians, 1.0F);
    auto gradients = sized<splat_model_gradients>();
    gradients.means = gradients.rotations = ones.data();
    const char* name = "grad:network_with_offset.encoder.enc.16x16_conv.weight";
    const auto backward = [&] {
        EXPECT_DONE(splat_model_backward(model, &gradients));
        return read(model, name, 216);
    };
    ASSERT_DONE(splat_model_zero_gradients(model));
    run(model);
    const Floats expected = backward();

    ASSERT_DONE(splat_model_zero_gradients(model));
    run(model);
    const Floats before = raw(model);
    const Floats other(3 * kGaussians, 0.75F);
    Floats pose(16, 0.0F);
    for (std::size_t i = 0; i < 4; ++i) pose[5 * i] = 1;
    pose[12] = 2;
    const float broken[4] = {1, 0, NAN, 0};
    auto input = sized<splat_model_input>();
    input.images = other.data();
    input.view_to_world = pose.data();
    input.quaternions = broken;
    EXPECT_REFUSED(splat_model_forward(model, &input), kArgument, "'quaternions' holds nan at 2");
    EXPECT_EQ(raw(model), before);

    // Neither do refused gradients, whichever they are.
    Floats not_finite = ones;
    not_finite[5] = INFINITY;
    splat_model_gradients wrong = gradients;
    wrong.opacities = ones.data();
    wrong.rotations = not_finite.data();
    EXPECT_REFUSED(splat_model_backward(model, &wrong), kArgument,
                   "splat_model_gradients.rotations holds inf at 5");
    wrong = gradients;
    wrong.sh = ones.data();
    wrong.sh_count = 7;
    EXPECT_REFUSED(splat_model_backward(model, &wrong), kShape,
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
    const Model model = got(splat_model_create, device_, &desc);
    ASSERT_DONE(splat_model_init(model, 3));
    for (std::size_t i = 0; i < image_.size(); ++i) image_[i] = static_cast<float>(i % 7) - 3;
    run(model);
    const Floats opacities = read(model, "opacities", kGaussians);
    EXPECT_EQ(opacities, Floats(kGaussians, 1.0F));
    const Floats scales = read(model, "scales", 3 * kGaussians);
    EXPECT_GT(std::count(scales.begin(), scales.end(), 0.0F), 0) << "the case under test";
    const splat_scene_info info = info_of(got(splat_model_scene, model, 0));
    EXPECT_EQ(info.non_finite, 0U);
    EXPECT_EQ(info.opacity_mean, 1.0);
}

TEST_F(ApiModel, MeansOfTheCarsModelAreItsConfiguration) {
    splat_model_desc desc = model_desc();
    desc.config = nullptr;
    EXPECT_TRUE(holds(report(got(splat_model_create, device_, desc)), "\"parameters\": 56378736"));
}

}  // namespace
}  // namespace splat::test
