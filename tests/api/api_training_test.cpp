// Batches and training sessions through the C API.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "api/api_calls.h"

namespace splat::test {
namespace {

/// The events until the end of the run: their kinds.
std::vector<splat_run_event_kind> run(splat_run training) {
    std::vector<splat_run_event_kind> kinds;
    auto event = sized<splat_run_event>();
    do {
        EXPECT_DONE(splat_run_next(training, &event));
        kinds.push_back(event.kind);
    } while (event.kind < SPLAT_EVENT_DONE && kinds.size() < 100);
    return kinds;
}

/// NaN where it is missing.
double number_of(const splat_run_event& event, const std::string& name) {
    for (std::uint64_t i = 0; i < event.number_count; ++i)
        if (name == event.numbers[i].name) return event.numbers[i].value;
    return NAN;
}

Training open(splat_device device, const splat_training_desc& desc) {
    return got(splat_training_open, device, &desc);
}

TEST(ApiBatches, FitTheTrainer) {
    const Device device = open_device();
    const Trainer trainer = make_trainer(device);
    const Batches batches = make_batches();
    auto batch = got(splat_batches_next, batches, 0);
    EXPECT_EQ(batch.objects, 2U);
    EXPECT_EQ(batch.channels, 3U);
    EXPECT_EQ(batch.images_count, 2U * 3 * 16 * 16);
    EXPECT_EQ(batch.view_to_world_count, 2U * 16);
    EXPECT_EQ(batch.targets_count, 2U * 2 * 3 * 16 * 16);
    EXPECT_EQ(batch.cameras_count, 2U * 2);
    EXPECT_EQ(batch.focals, nullptr);
    EXPECT_EQ(batch.focals_count, 0U);
    EXPECT_EQ(batch.cameras[0].width, 16U);
    const float first = batch.images[100];
    const auto info = got(splat_trainer_step, trainer, &batch);
    EXPECT_EQ(info.step, 1U);
    ASSERT_DONE(splat_batches_next(batches, 5, &batch));
    ASSERT_DONE(splat_batches_next(batches, 0, &batch));
    EXPECT_EQ(batch.images[100], first);
}

TEST(ApiBatches, GivePlanesToTheirLoss) {
    const Temporary folder;
    write_cars_with_planes(folder.path());
    splat_dataset_desc data = dataset_desc();
    data.path = folder.c_str();
    data.flags = SPLAT_DATA_PLANE;
    data.resolution = 16;
    std::fill_n(data.background, 3, 1.0F);
    const char* const weight = "opt.lambda_plane=10";
    const std::string config =
        text_of(splat_config_merge, trainer_desc().config, &weight, std::size_t{1});
    const Device device = open_device();
    splat_trainer_desc desc = trainer_desc();
    desc.config = config.c_str();
    const Trainer trainer = got(splat_trainer_create, device, &desc);
    const Dataset dataset = got(splat_dataset_open, &data);
    const Batches batches = got(splat_batches_create, dataset, config.c_str(), 1);
    auto batch = got(splat_batches_next, batches, 0);
    ASSERT_EQ(batch.planes_count, 2U * 5 * 16 * 16);
    EXPECT_EQ(batch.planes[0], 7 / 255.0F);
    EXPECT_EQ(batch.planes[5 * 256 - 1], 0.5F) << "the id of the larger plane";
    auto info = got(splat_trainer_step, trainer, &batch);
    EXPECT_EQ(info.step, 1U);
    EXPECT_GT(info.plane_loss, 0);
    info.plane_loss = -1;
    info.struct_size = offsetof(splat_trainer_info, plane_loss);  // a caller who knows none
    EXPECT_DONE(splat_trainer_step(trainer, &batch, &info));
    EXPECT_EQ(info.plane_loss, -1);
    --batch.planes_count;
    EXPECT_REFUSED(splat_trainer_step(trainer, &batch, &info), kShape,
                   "splat_trainer_batch.planes has 2559 numbers, expected 2560: [2, 5, 16, 16]");
    const char* const missing =
        "splat_trainer_batch.planes is NULL, expected 1280 numbers for each image: the "
        "configuration has opt.lambda_plane 10";
    batch.struct_size = offsetof(splat_trainer_batch, planes);
    EXPECT_REFUSED(splat_trainer_step(trainer, &batch, &info), kArgument, missing);
    batch.struct_size = sizeof batch;
    batch.planes = nullptr;
    batch.planes_count = 0;
    EXPECT_REFUSED(splat_trainer_step(trainer, &batch, &info), kArgument, missing);
    EXPECT_EQ(info.step, 2U);
}

TEST(ApiTraining, GivesWhatItDoes) {
    const Device device = open_device();
    const Dataset dataset = make_training_dataset();
    const std::string folder = run_folder();
    splat_training_desc desc = training_desc(dataset, folder);
    desc.validation = dataset;
    const Training training = open(device, desc);
    auto event = got(splat_run_next, training);
    EXPECT_EQ(event.kind, SPLAT_EVENT_MESSAGE);
    EXPECT_EQ(std::string(event.text).substr(0, 9), "training ");
    EXPECT_EQ(event.number_count, 0U);
    auto info = sized<splat_trainer_info>();
    EXPECT_REFUSED(splat_training_last_step(training, &info), kState, "has done no step yet");
    ASSERT_DONE(splat_run_next(training, &event));
    EXPECT_EQ(event.kind, SPLAT_EVENT_CHECKPOINT);
    ASSERT_DONE(splat_run_next(training, &event));
    ASSERT_EQ(event.kind, SPLAT_EVENT_VALIDATED_PIECE);
    EXPECT_EQ(event.views, 3U);
    EXPECT_EQ(event.inputs, 1U);
    EXPECT_EQ(event.width, 16U);
    EXPECT_EQ(event.height, 16U);
    EXPECT_EQ(event.image_count, 3U * 3 * 16 * 16);
    EXPECT_GT(number_of(event, "val_psnr"), 0);
    EXPECT_STREQ(event.name, "000000_car");
    ASSERT_DONE(splat_run_next(training, &event));
    ASSERT_DONE(splat_run_next(training, &event));
    EXPECT_EQ(event.kind, SPLAT_EVENT_VALIDATION);
    EXPECT_EQ(event.pieces, 2U);
    EXPECT_EQ(number_of(event, "val_views"), 4) << "novel ones";
    ASSERT_DONE(splat_run_next(training, &event));
    ASSERT_EQ(event.kind, SPLAT_EVENT_STEP);
    EXPECT_EQ(event.updated, 1U);
    ASSERT_DONE(splat_training_last_step(training, &info));
    EXPECT_EQ(info.step, 1U);
    EXPECT_EQ(info.loss, number_of(event, "loss"));
    got(splat_training_model, training);
    EXPECT_EQ(run(training).back(), SPLAT_EVENT_DONE);
    EXPECT_TRUE(holds(text_of(splat_run_report, training), "\"step\": 2"));
}

/// A session that is left after its first step, and one that is interrupted before its second.
TEST(ApiTraining, GoesOnWithTheSameBits) {
    const Device device = open_device();
    const Dataset dataset = make_training_dataset();
    const std::string whole = run_folder();
    run(open(device, training_desc(dataset, whole)));
    for (const bool interrupted : {false, true}) {
        const std::string parts = run_folder();
        {
            const Training training = open(device, training_desc(dataset, parts));
            auto event = sized<splat_run_event>();
            while (event.step < 1) ASSERT_DONE(splat_run_next(training, &event));
            if (interrupted) {
                ASSERT_DONE(splat_run_interrupt(training));
                EXPECT_EQ(run(training), (std::vector<splat_run_event_kind>{
                                             SPLAT_EVENT_CHECKPOINT, SPLAT_EVENT_INTERRUPTED}));
            }
        }
        splat_training_desc desc = training_desc(dataset, parts);
        desc.flags = SPLAT_TRAINING_RESUME;
        desc.config = nullptr;
        EXPECT_EQ(run(open(device, desc)).back(), SPLAT_EVENT_DONE);
        EXPECT_TRUE(file_bytes(parts + "/weights_last.safetensors") ==
                    file_bytes(whole + "/weights_last.safetensors"));
    }
}

/// What was not computed is not told as a number.
TEST(ApiTraining, AFinishedRunThatIsResumedTellsNoLoss) {
    const Device device = open_device();
    const Dataset dataset = make_training_dataset();
    const std::string folder = run_folder();
    splat_training_desc desc = training_desc(dataset, folder);
    run(open(device, desc));
    desc.flags = SPLAT_TRAINING_RESUME;
    const Training training = open(device, desc);
    auto event = sized<splat_run_event>();
    std::string text;
    while (event.kind < SPLAT_EVENT_DONE) {
        ASSERT_DONE(splat_run_next(training, &event));
        EXPECT_TRUE(std::isnan(number_of(event, "averaged_loss")));
        if (event.text != nullptr) text = event.text;
    }
    EXPECT_EQ(text, "done: 2 steps");
    const std::string report = text_of(splat_run_report, training);
    EXPECT_TRUE(holds(report, "\"loss\": null"));
}

TEST(ApiTraining, HasItsFolderForItself) {
    const Device device = open_device();
    const Dataset dataset = make_training_dataset();
    const std::string folder = run_folder();
    splat_training_desc desc = training_desc(dataset, folder);
    const Training training = open(device, desc);
    for (const std::uint32_t flags :
         {std::uint32_t{SPLAT_TRAINING_RESUME}, std::uint32_t{SPLAT_TRAINING_OVERWRITE}}) {
        desc.flags = flags;
        splat_run second = nullptr;
        EXPECT_REFUSED(splat_training_open(device, &desc, &second), kState, "is in use");
    }
}

}  // namespace
}  // namespace splat::test
