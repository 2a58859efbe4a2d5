#include "api/api_guard.h"
#include "api/handles.h"
#include "api/scene/camera_value.h"
#include "api/train/settings.h"

using namespace splat;

namespace {

splat_trainer_batch batch_of(const api::BatchesObject& object) {
    const train::Batch& from = object.batch;
    const auto give = [](const std::vector<float>& values, const float*& array, uint64_t& count) {
        array = values.empty() ? nullptr : values.data();
        count = values.size();
    };
    splat_trainer_batch batch{};
    give(from.images, batch.images, batch.images_count);
    give(from.view_to_world, batch.view_to_world, batch.view_to_world_count);
    give(from.quaternions, batch.quaternions, batch.quaternions_count);
    give(from.focals, batch.focals, batch.focals_count);
    give(from.embedding, batch.embedding, batch.embedding_count);
    give(from.tokens, batch.tokens, batch.tokens_count);
    give(from.planes, batch.planes, batch.planes_count);
    give(object.targets, batch.targets, batch.targets_count);
    batch.cameras = object.cameras.data();
    batch.cameras_count = object.cameras.size();
    batch.channels = object.channels;
    batch.objects = object.objects;
    return batch;
}

}  // namespace

splat_result splat_batches_create(splat_dataset dataset, const char* config, uint64_t seed,
                                  splat_batches* batches) {
    const auto make = [&](const auto& found) -> api::AllBatches::Made {
        SPLAT_ASSIGN(const config::Settings settings,
                     api::training_settings_of(config, config::VectorsFrom::kFiles));
        SPLAT_ASSIGN(auto views, predict::ViewSource::open(settings, api::dataset_of(found)));
        train::BatchSource source(std::move(views), settings, seed);
        SPLAT_TRY(source.check());
        auto object = std::make_shared<api::BatchesObject>();
        object->channels = settings.network.input_channels();
        object->objects = settings.training.batch_size;
        // The device, which may be the CPU, is not known here.
        SPLAT_ASSIGN(object->source,
                     train::Prefetch::create(std::move(source),
                                             train::loader_threads(settings.training, true)));
        return object;
    };
    return api::create_of(dataset, batches, make);
}

splat_result splat_batches_next(splat_batches batches, uint64_t step, splat_trainer_batch* batch) {
    return api::with(batches, [&](const auto& object) -> Status {
        SPLAT_TRY(api::require(batch, "batch"));
        SPLAT_TRY(api::check_filled(*batch));
        SPLAT_ASSIGN(object->batch, object->source->get(step));
        object->targets.clear();
        for (const std::uint8_t level : object->batch.levels)
            object->targets.push_back(static_cast<float>(level) / 255.0F);
        object->cameras.clear();
        for (const scene::Camera& camera : object->batch.cameras)
            object->cameras.push_back(api::value_of(camera));
        api::give(batch_of(*object), batch);
        return {};
    });
}
