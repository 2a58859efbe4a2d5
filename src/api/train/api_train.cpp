#include "api/api_guard.h"
#include "api/handles.h"
#include "api/model/network_arrays.h"
#include "api/scene/camera_value.h"
#include "api/train/settings.h"
#include "api/train/trainer_info.h"
#include "config/config_file.h"
#include "data/planes/plane_channels.h"
#include "train/training_facts.h"

using namespace splat;

namespace {

/// The caller's arrays, with the lengths that the configuration implies.
struct Arrays {
    std::vector<scene::Camera> cameras;
    train::TrainBatch batch;
};

Status take(const splat_trainer_batch& from, const config::ModelConfig& network,
            const config::TrainConfig& training, Arrays& to) {
    SPLAT_TRY(api::require(from.images, "splat_trainer_batch.images"));
    SPLAT_TRY(api::require(from.view_to_world, "splat_trainer_batch.view_to_world"));
    SPLAT_TRY(api::require(from.quaternions, "splat_trainer_batch.quaternions"));
    SPLAT_TRY(api::require(from.targets, "splat_trainer_batch.targets"));
    SPLAT_TRY(api::require(from.cameras, "splat_trainer_batch.cameras"));
    SPLAT_TRY(api::check_network_arrays({"splat_trainer_batch", from.focals, from.embedding,
                                         from.tokens, from.channels, from.objects},
                                        network, training.batch_size));
    const std::uint64_t r = network.resolution;
    const std::uint32_t plane = training.plane_weight > 0 ? data::kPlaneChannels : 0;
    SPLAT_TRY(api::check_array("splat_trainer_batch", "planes", from.planes,
                               plane * network.resolution * network.resolution,
                               format("opt.lambda_plane %g", training.plane_weight)));
    const std::size_t inputs = std::size_t{training.batch_size} * network.views;
    const std::size_t targets = std::size_t{training.batch_size} * training.targets;
    if (from.cameras_count != 0 && from.cameras_count != targets)
        return error(Code::kShape, "splat_trainer_batch.cameras has %llu cameras, expected %zu",
                     llu(from.cameras_count), targets);
    const auto array = [](const char* name, const float* values, std::uint64_t count,
                          const std::vector<std::uint64_t>& dims) {
        return api::host_array("splat_trainer_batch", name, {values, count}, dims);
    };
    for (std::size_t i = 0; i < targets; ++i)
        to.cameras.push_back(api::camera_of(from.cameras[i], format("cameras[%zu]", i)));
    train::TrainBatch& batch = to.batch;
    SPLAT_ASSIGN(batch.images, array("images", from.images, from.images_count,
                                     {inputs, network.input_channels(), r, r}));
    SPLAT_ASSIGN(batch.view_to_world, array("view_to_world", from.view_to_world,
                                            from.view_to_world_count, {inputs, 4, 4}));
    SPLAT_ASSIGN(batch.quaternions,
                 array("quaternions", from.quaternions, from.quaternions_count, {inputs, 4}));
    SPLAT_ASSIGN(batch.focals, array("focals", from.focals, from.focals_count, {inputs, 2}));
    SPLAT_ASSIGN(batch.embedding, array("embedding", from.embedding, from.embedding_count,
                                        {inputs, network.embedding_length()}));
    SPLAT_ASSIGN(batch.tokens, array("tokens", from.tokens, from.tokens_count,
                                     {inputs, network.token_dim, network.tokens}));
    SPLAT_ASSIGN(batch.planes,
                 array("planes", from.planes, from.planes_count, {inputs, plane, r, r}));
    SPLAT_ASSIGN(batch.targets,
                 array("targets", from.targets, from.targets_count, {targets, 3, r, r}));
    to.batch.cameras = to.cameras;
    return {};
}

/// Set what splat_trainer_report tells of the steps. The context's mutex is held.
void publish(api::TrainerObject& object) {
    const train::Trainer& trainer = *object.trainer;
    object.counters.set(
        {trainer.steps(), trainer.attempts(), trainer.unread(), trainer.skipped_in_a_row()});
}

Status resume(api::TrainerObject& object, const io::WeightsFile& file) {
    const Status done = object.trainer->resume(file);
    publish(object);
    return done;
}

Result<io::WeightsFile> checkpoint(api::TrainerObject& object) {
    auto file = object.trainer->checkpoint();
    publish(object);
    return file;
}

std::string report_of(const api::TrainerObject& object) {
    train::Trainer& trainer = *object.trainer;
    model::Model& network = trainer.model();
    const auto counters = object.counters.get();
    const auto last = trainer.last();
    JsonWriter json;
    json.begin_object().member("step", counters.steps).member("attempts", counters.attempts);
    json.member("unread", counters.unread).member("skipped", counters.skipped);
    json.member("parameters", network.parameters().elements())
        .member("trainable", train::trainable_of(network.parameters()));
    run::add_ledger(json, last ? std::optional(train::ledger_of(*last)) : std::nullopt);
    json.key("config").raw(config::merged_config_text({network.config(), trainer.config()})).end();
    return json.text();
}

}  // namespace

splat_trainer_info api::info_of(const train::TrainStep& step) {
    splat_trainer_info info{};
    SPLAT_COPY(info, step, skipped, step, pairs, visible, culled, non_finite, gradients_zero, rate);
    info.loss = step.loss.total;
    info.squared_error = step.loss.squared;
    info.pixel_loss = step.loss.pixel;
    info.ssim = step.loss.of("ssim");
    info.network_ms = 1e3 * step.network_seconds;
    info.render_ms = 1e3 * step.render_seconds;
    info.update_ms = 1e3 * step.update_seconds;
    info.edge_loss = step.loss.of("edge");
    info.plane_loss = step.loss.of("plane");
    info.lpips = step.loss.of("lpips");
    return info;
}

std::shared_ptr<api::ModelObject> api::model_of(const std::shared_ptr<vk::Context>& context,
                                                const std::shared_ptr<train::Trainer>& trainer) {
    auto made = std::make_shared<api::ModelObject>(context);
    made->objects = trainer->config().micro_batch;
    made->flags = SPLAT_MODEL_GRADIENTS | SPLAT_MODEL_TRAINING;
    if (trainer->config().recompute) made->flags |= SPLAT_MODEL_RECOMPUTE;
    made->model = {trainer, &trainer->model()};
    return made;
}

splat_result splat_config_keys(char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [] { return config::keys_json(); });
}

splat_result splat_config_merge(const char* text, const char* const* values, size_t count,
                                char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        SPLAT_ASSIGN(const std::vector<std::string> texts, api::texts_of(values, count));
        SPLAT_ASSIGN(const config::Settings made, api::settings_of(text, texts));
        return config::merged_config_text(made);
    });
}

splat_result splat_trainer_create(splat_device device, const splat_trainer_desc* desc,
                                  splat_trainer* trainer) {
    const auto make = [&](const auto& owner) -> api::Trainers::Made {
        SPLAT_TRY(api::check_desc(desc, 0));
        SPLAT_ASSIGN(const config::Settings made,
                     api::training_settings_of(desc->config, config::VectorsFrom::kCaller));
        SPLAT_TRY(owner->test(api::kAllKernels));
        auto object = std::make_shared<api::TrainerObject>(owner->context);
        const std::lock_guard lock(object->context->mutex);
        SPLAT_TRY(object->context->device().alive());
        SPLAT_ASSIGN(object->trainer,
                     train::Trainer::create(*object->context, made.network, made.training));
        return object;
    };
    return api::create_of(device, trainer, make);
}

splat_result splat_trainer_model(splat_trainer trainer, splat_model* model) {
    return api::create_of(trainer, model, [](const auto& object) {
        return api::model_of(object->context, object->trainer);
    });
}

splat_result splat_trainer_step(splat_trainer trainer, const splat_trainer_batch* batch,
                                splat_trainer_info* info) {
    return api::locked(trainer, [&](auto& object) -> Status {
        splat_trainer_batch taken{};
        SPLAT_TRY(api::take_input(batch, "batch", taken));
        if (info != nullptr) SPLAT_TRY(api::check_fill(info, "info"));
        Arrays arrays;
        SPLAT_TRY(take(taken, object.trainer->model().config(), object.trainer->config(), arrays));
        train::TrainStep step;
        const Status done = info == nullptr ? object.trainer->step(arrays.batch)
                                            : object.trainer->step(arrays.batch, step);
        publish(object);
        SPLAT_TRY(done);
        if (info != nullptr) api::give(api::info_of(step), info);
        return {};
    });
}

splat_result splat_trainer_read(splat_trainer trainer, splat_trainer_info* infos, size_t capacity,
                                size_t* count) {
    bool cut = false;
    const splat_result result = api::locked(trainer, [&](auto& object) -> Status {
        if (capacity > 0) SPLAT_TRY(api::check_fill(infos, "infos"));
        const std::size_t stride = capacity > 0 ? infos->struct_size : 0;
        const auto at = [&](std::size_t i) {
            return reinterpret_cast<splat_trainer_info*>(reinterpret_cast<char*>(infos) +
                                                         i * stride);
        };
        for (std::size_t i = 0; i < capacity; ++i)
            if (at(i)->struct_size != stride)
                return invalid("infos[%zu].struct_size is %u, expected %zu as that of infos[0]", i,
                               at(i)->struct_size, stride);
        const Status done = object.trainer->read();
        publish(object);
        SPLAT_TRY(done);
        std::deque<train::TrainStep>& results = object.trainer->results();
        if (count != nullptr) *count = results.size();
        cut = results.size() > capacity;
        for (std::size_t i = 0; i < capacity && !results.empty(); ++i) {
            api::give(api::info_of(results.front()), at(i));
            results.pop_front();
        }
        return {};
    });
    return result == SPLAT_OK && cut ? SPLAT_INCOMPLETE : result;
}

splat_result splat_trainer_report(splat_trainer trainer, char* buffer, size_t capacity,
                                  size_t* needed) {
    return api::report(trainer, buffer, capacity, needed,
                       [](auto& object) { return report_of(object); });
}

splat_result splat_trainer_store(splat_trainer trainer, splat_weights* weights) {
    return api::locked(trainer, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(weights, "weights"));
        auto made = std::make_shared<api::WeightsObject>();
        auto state = object.trainer->averaged_state();
        publish(object);
        SPLAT_ASSIGN(made->file.tensors, std::move(state));
        made->from = "model";
        *weights = api::Weights::add(std::move(made));
        return {};
    });
}

splat_result splat_trainer_save(splat_trainer trainer, const char* path) {
    return api::locked(trainer, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(path, "path"));
        if (!std::string_view(path).ends_with(".safetensors"))  // others lose the metadata
            return unsupported("'%s': a training is saved as .safetensors", path);
        SPLAT_ASSIGN(const io::WeightsFile file, checkpoint(object));
        return io::save_weights(file, path);
    });
}

splat_result splat_trainer_save_memory(splat_trainer trainer, void* buffer, size_t capacity,
                                       size_t* needed) {
    return api::guarded_bytes(buffer, capacity, needed, [&](auto give) -> Status {
        SPLAT_ASSIGN(const auto object, api::find(trainer));
        const std::lock_guard lock(object->context->mutex);
        SPLAT_TRY(object->context->mutex.check());
        SPLAT_ASSIGN(const io::WeightsFile file, checkpoint(*object));
        SPLAT_ASSIGN(const io::FilePieces pieces,
                     io::write_weights(file, io::WeightsFormat::kSafetensors));
        return give(pieces.pieces());
    });
}

splat_result splat_trainer_resume_memory(splat_trainer trainer, const void* data, size_t bytes) {
    return api::locked(trainer, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(data, "data"));
        SPLAT_ASSIGN(const io::WeightsFile file,
                     io::read_weights(
                         io::MemorySource({static_cast<const std::byte*>(data), bytes}), "memory"));
        return resume(object, file);
    });
}

splat_result splat_trainer_resume(splat_trainer trainer, const char* path) {
    return api::locked(trainer, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(path, "path"));
        SPLAT_ASSIGN(const io::WeightsFile file, io::load_weights(path));
        return resume(object, file);
    });
}
