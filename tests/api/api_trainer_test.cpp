// Training through the C API.
#include <cmath>
#include <nlohmann/json.hpp>

#include "api/api_calls.h"

namespace splat::test {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kSide = 16;

class ApiTrainer : public testing::Test {
  protected:
    splat_trainer_info step(const Trainer& trainer) {
        return got(splat_trainer_step, trainer, batch_.desc());
    }
    Model initialised(const Trainer& trainer) {
        Model model = got(splat_trainer_model, trainer);
        EXPECT_DONE(splat_model_init(model, 3));
        return model;
    }
    Floats bias(const Model& model) {
        return floats_of(24, splat_model_read, model, "network_with_offset.out.bias");
    }

    Device device_ = open_device();
    const TrainerBatch batch_;
};

TEST_F(ApiTrainer, LearnsAndGoesOnFromAFile) {
    const Trainer trainer = make_trainer(device_);
    const Model model = initialised(trainer);
    const splat_trainer_info first = step(trainer);
    EXPECT_EQ(first.step, 1U);
    EXPECT_EQ(first.skipped, 0U);
    EXPECT_GT(first.pairs, 0U);
    splat_trainer_info last{};
    for (int i = 0; i < 5; ++i) last = step(trainer);
    EXPECT_LT(last.loss, first.loss);

    const Temporary path(".safetensors");
    ASSERT_DONE(splat_trainer_save(trainer, path.c_str()));
    const Trainer other = make_trainer(device_);
    const Model other_model = initialised(other);
    ASSERT_DONE(splat_trainer_resume(other, path.c_str()));
    EXPECT_EQ(bias(other_model), bias(model));

    const std::string file = file_bytes(path.path());
    std::string memory = bytes_of(splat_trainer_save_memory, trainer);
    EXPECT_TRUE(memory == file) << "the bytes in memory differ from those of the file";
    const Trainer third = make_trainer(device_);
    const Model third_model = initialised(third);
    for (const std::size_t size : {file.size() / 3, file.size() - 1})
        EXPECT_REFUSED(splat_trainer_resume_memory(third, file.data(), size), kFormat,
                       "'memory': safetensors");
    memory[memory.size() - 2] ^= 1;
    EXPECT_REFUSED(splat_trainer_resume_memory(third, memory.data(), memory.size()), kFormat,
                   "its checksum is");
    ASSERT_DONE(splat_trainer_resume_memory(third, file.data(), file.size()));
    EXPECT_EQ(bias(third_model), bias(model));

    const double loss = step(trainer).loss;
    EXPECT_EQ(step(third).loss, loss);
    EXPECT_EQ(step(other).loss, loss);
    EXPECT_EQ(bias(other_model), bias(model));
}

/// Steps whose info is NULL do the same, and are told later, each once.
TEST_F(ApiTrainer, TellsLaterWhatStepsDid) {
    const Trainer trainer = make_trainer(device_), later = make_trainer(device_);
    const Model model = initialised(trainer), later_model = initialised(later);
    const splat_trainer_batch batch = batch_.desc();
    const auto report = [&] { return Json::parse(text_of(splat_trainer_report, later)); };
    std::vector<splat_trainer_info> expected, given;
    for (int i = 0; i < 3; ++i) {
        expected.push_back(step(trainer));
        ASSERT_DONE(splat_trainer_step(later, &batch, nullptr));
    }
    EXPECT_EQ(report().at("attempts"), 3);
    EXPECT_EQ(report().at("unread"), 3);
    EXPECT_EQ(report().at("step"), 0);
    EXPECT_TRUE(report().at("ledger").is_null());
    std::size_t count = 0;
    EXPECT_EQ(splat_trainer_read(later, nullptr, 0, &count), SPLAT_INCOMPLETE);
    EXPECT_EQ(count, 3U);
    EXPECT_EQ(report().at("unread"), 0);
    EXPECT_EQ(report().at("step"), 3);
    EXPECT_EQ(report().at("skipped"), 0);
    splat_trainer_info infos[2] = {sized<splat_trainer_info>(), sized<splat_trainer_info>()};
    infos[1].struct_size -= 8;
    EXPECT_REFUSED(splat_trainer_read(later, infos, 2, &count), kArgument,
                   "infos[1].struct_size is 136, expected 144");
    EXPECT_REFUSED(splat_trainer_read(later, nullptr, 2, &count), kArgument, "infos is NULL");
    infos[1].struct_size += 8;
    EXPECT_EQ(splat_trainer_read(later, infos, 2, &count), SPLAT_INCOMPLETE);
    EXPECT_EQ(count, 3U);
    given.insert(given.end(), infos, infos + 2);
    ASSERT_DONE(splat_trainer_read(later, infos, 2, &count));
    EXPECT_EQ(count, 1U);
    given.push_back(infos[0]);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(given[i].loss, expected[i].loss);
        EXPECT_EQ(given[i].step, i + 1);
        EXPECT_EQ(given[i].visible, expected[i].visible);
        EXPECT_EQ(given[i].rate, expected[i].rate);
    }
    EXPECT_EQ(bias(later_model), bias(model));
    EXPECT_EQ(step(later).loss, step(trainer).loss);
    ASSERT_DONE(splat_trainer_read(later, nullptr, 0, &count));
    EXPECT_EQ(count, 0U);
}

TEST_F(ApiTrainer, ItsModelOutlivesIt) {
    Trainer trainer = make_trainer(device_);
    const Model model = initialised(trainer);
    step(trainer);
    const Floats values = bias(model);
    const Weights averaged = got(splat_trainer_store, trainer);
    trainer.destroy();
    EXPECT_EQ(bias(model), values);
    const Model fresh = make_model(device_);
    ASSERT_DONE(splat_model_load(fresh, averaged, 0));
    EXPECT_EQ(bias(fresh), values) << "the first average is a copy";
}

TEST_F(ApiTrainer, ComparesTheBatchWithItsConfiguration) {
    const Trainer trainer = make_trainer(device_);
    const Model model = initialised(trainer);
    auto info = sized<splat_trainer_info>();
    splat_trainer_batch batch = batch_.desc();
    const auto refused = [&](splat_result code, const char* part) {
        EXPECT_REFUSED(splat_trainer_step(trainer, &batch, &info), code, part);
    };
    batch.channels = 7;
    refused(kShape, "splat_trainer_batch.channels is 7, expected 3: RGB");
    batch.channels = 3;
    batch.objects = 1;
    refused(kShape, "splat_trainer_batch.objects is 1, expected 2");
    batch.objects = 2;
    batch.focals = batch.quaternions;
    refused(kArgument, "splat_trainer_batch.focals is given, expected NULL");
    batch.focals = nullptr;
    batch.planes = batch.images;
    refused(kArgument,
            "splat_trainer_batch.planes is given, expected NULL: the configuration has "
            "opt.lambda_plane 0");
    batch.planes = nullptr;
    batch.planes_count = 10;
    refused(kArgument, "splat_trainer_batch.planes is NULL, but planes_count is 10");
    batch.struct_size = offsetof(splat_trainer_batch, planes);  // a caller who knows no planes
    EXPECT_DONE(splat_trainer_step(trainer, &batch, &info));
    batch.struct_size = sizeof batch;
    batch.planes_count = 0;
    batch.targets_count = 10;
    refused(kShape, "splat_trainer_batch.targets has 10 numbers, expected 3072: [4, 3, 16, 16]");
    batch.targets_count = 3072;
    batch.cameras_count = 3;
    refused(kShape, "splat_trainer_batch.cameras has 3 cameras, expected 4");
    batch.cameras_count = 4;
    EXPECT_DONE(splat_trainer_step(trainer, &batch, &info));
    EXPECT_EQ(info.step, 2U);
    EXPECT_EQ(info.plane_loss, 0);
}

/// What a step saw: Gaussians in front of the cameras, and with the cameras turned away.
TEST_F(ApiTrainer, TellsWhatWasVisible) {
    const Trainer trainer = make_trainer(device_);
    const Model model = initialised(trainer);
    const std::uint64_t pairs = 2 * 2 * kSide * kSide;  // objects, targets, Gaussians
    const auto report = [&] { return Json::parse(text_of(splat_trainer_report, trainer)); };
    EXPECT_TRUE(report().at("ledger").is_null());
    const splat_trainer_info seen = step(trainer);
    EXPECT_GT(seen.visible, 0U);
    EXPECT_EQ(seen.visible + seen.culled, pairs);
    EXPECT_EQ(seen.non_finite, 0U);
    EXPECT_EQ(seen.gradients_zero, 0U);
    EXPECT_EQ(seen.rate, 1e-3);
    TrainerBatch away = batch_;
    for (splat_camera& camera : away.cameras)  // half a turn about y
        camera.world_to_camera[0] = camera.world_to_camera[10] = -1;
    const splat_trainer_batch batch = away.desc();
    const auto info = got(splat_trainer_step, trainer, &batch);
    EXPECT_EQ(info.visible, 0U);
    EXPECT_EQ(info.culled, pairs);
    EXPECT_EQ(info.gradients_zero, 1U);
    EXPECT_EQ(
        report().at("ledger"),
        (Json{{"visible", 0}, {"culled", pairs}, {"non_finite", 0}, {"gradients_zero", true}}));
    const auto about = got(splat_model_get_info, model);
    EXPECT_EQ(about.predicted, about.objects * kSide * kSide);
}

TEST_F(ApiTrainer, MergesConfigurations) {
    const char* const values[] = {"opt.base_lr=1e-4", "data.training_resolution=32"};
    const std::string text = text_of(splat_config_merge, kSmallModel, values, 2);
    EXPECT_TRUE(holds(text, "\"base_lr\": 0.0001"));
    EXPECT_TRUE(holds(text, "\"training_resolution\": 32"));
    EXPECT_TRUE(holds(text, "\"base_dim\": 8"));
    EXPECT_TRUE(text_of(splat_config_check, "logging: {loop_log: 5}", nullptr, 0)
                    .starts_with("{\"warnings\": [\"configuration: 'logging.loop_log' has no "
                                 "effect here"));
    EXPECT_REFUSED(splat_config_check("opt: {lora_rank: 8}", nullptr, 0, nullptr, 0, nullptr),
                   kArgument, "'opt.lora_rank' is 8, but without");
    EXPECT_REFUSED(splat_config_merge("opt: {base_rate: 1}", nullptr, 0, nullptr, 0, nullptr),
                   kArgument, "there is no key 'opt.base_rate'");
}

TEST_F(ApiTrainer, RefusesWhatTheCheckOfConfigurationsRefuses) {
    for (const char* keys : {"\nopt: {pretrained_hf: true}", "\nopt: {lora_rank: 8}"}) {
        const std::string config = std::string(kSmallModel) + keys;
        EXPECT_REFUSED(splat_config_check(config.c_str(), nullptr, 0, nullptr, 0, nullptr),
                       kArgument, "configuration: 'opt.");
        const std::string sentence = splat_last_error_message();
        splat_trainer_desc desc = trainer_desc();
        desc.config = config.c_str();
        Trainer made;
        EXPECT_REFUSED(splat_trainer_create(device_, &desc, made.out()), kArgument, sentence);
        Batches batches;
        EXPECT_REFUSED(
            splat_batches_create(make_training_dataset(), config.c_str(), 1, batches.out()),
            kArgument, sentence);
    }
}

TEST_F(ApiTrainer, HasThePublishedConfigurations) {
    const Json presets = Json::parse(text_of(splat_config_presets));
    ASSERT_GT(presets.size(), 7U);
    for (const Json& preset : presets) {
        const std::string name = preset.at("name");
        EXPECT_FALSE(preset.at("about").get<std::string>().empty()) << name;
        const std::string yaml = text_of(splat_config_preset, name.c_str());
        const Json merged = Json::parse(text_of(splat_config_merge, yaml.c_str(), nullptr, 0));
        const bool small = name == "small";  // the only one that nobody published
        const bool lgm = name.starts_with("lgm");
        if (!lgm) {
            EXPECT_EQ(merged.at("model").at("base_dim"), small ? 32 : 128) << name;
        }
        const int side = lgm || name.starts_with("f3d") ? 256 : name.starts_with("nmr") ? 64 : 128;
        EXPECT_EQ(merged.at("data").at("training_resolution"), small ? 32 : side) << name;
    }
    EXPECT_REFUSED(splat_config_preset("car", nullptr, 0, nullptr), kArgument, "there are: cars, ");
}

TEST_F(ApiTrainer, ListsTheKeysOfConfigurations) {
    const Json keys = Json::parse(text_of(splat_config_keys));
    ASSERT_GT(keys.size(), 90U);
    for (const Json& key : keys) {
        const std::string name = key.at("key");
        EXPECT_FALSE(key.at("about").get<std::string>().empty()) << name;
        EXPECT_TRUE(key.at("range").is_string() && key.at("effect").is_boolean()) << name;
        const std::string type = key.at("type");
        const Json& value = key.at("default");
        EXPECT_TRUE(value.is_null()     ? !key.at("effect").get<bool>()
                    : type == "integer" ? value.is_number_integer()
                    : type == "number"  ? value.is_number()
                    : type == "boolean" ? value.is_boolean()
                    : type[0] == 'l'    ? value.is_array()
                                        : value.is_string())
            << key;
    }
}

TEST_F(ApiTrainer, RefusesAFileThatIsNoState) {
    const Trainer trainer = make_trainer(device_);
    const Model model = initialised(trainer);
    const Temporary path(".safetensors");
    const Weights weights = got(splat_model_store, model);
    ASSERT_DONE(splat_weights_save(weights, path.c_str(), 0));
    EXPECT_REFUSED(splat_trainer_resume(trainer, path.c_str()), kFormat, "is not a training state");
}

TEST_F(ApiTrainer, ComparesImages) {
    const splat_image a = planes_image(batch_.images.data(), kSide);
    const splat_image b = planes_image(batch_.targets.data(), kSide);
    const auto scores = got(splat_image_compare, &a, &b);
    EXPECT_NEAR(scores.psnr, -10 * std::log10(0.0625), 1e-9);
    EXPECT_LT(scores.ssim, 1);
}

}  // namespace
}  // namespace splat::test
