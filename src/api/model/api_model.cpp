#include "api/api_guard.h"
#include "api/handles.h"
#include "api/model/model_tensors.h"
#include "config/config_file.h"
#include "core/json_writer.h"
#include "model/adapters.h"
#include "predict/predictor.h"
#include "predict/published.h"

using namespace splat;

namespace {

using ModelPointer = std::shared_ptr<api::ModelObject>;

Result<config::ModelConfig> config_of(const char* text) {
    if (text == nullptr) return config::ModelConfig();
    SPLAT_ASSIGN(const Config config, read_config(text, "configuration"));
    return config::model_config(config);
}

void add_ledger(JsonWriter& json, const model::Ledger& ledger) {
    json.key("ledger").begin_object().member("gaussians", ledger.gaussians);
    json.member("non_finite", ledger.non_finite()).member("faint", ledger.set.faint).end();
}

JsonWriter& begin_tensor(JsonWriter& json, const char* name, const Shape& shape) {
    return json.newline(2).begin_object().member("name", name).key("shape").raw(shape.text());
}

void add_tensors(JsonWriter& json, model::Model& network) {
    json.newline(1).key("inputs").begin_array();
    for (const model::Model::Port& port : network.inputs())
        begin_tensor(json, port.name, port.shape).member("optional", port.optional).end();
    json.end().newline(1).key("outputs").begin_array();
    for (const api::ModelOutput& output : api::model_outputs(network))
        begin_tensor(json, output.name, output.shape).end();
    json.end().newline(1).key("tensors").begin_array();
    for (const nn::Parameter& parameter : network.parameters().all())
        begin_tensor(json, parameter.name.c_str(), parameter.shape)
            .member("trainable", parameter.trainable)
            .end();
    json.end();
}

std::string report_of(api::ModelObject& object) {
    const model::Model& network = *object.model;
    std::uint64_t trainable = 0;
    for (const nn::Parameter& parameter : object.model->parameters().all())
        if (parameter.trainable) trainable += parameter.shape.elements();
    const nn::ExecutorMemory memory = network.executor().memory();
    const model::LoadReport load = object.load.get();
    JsonWriter json;
    json.begin_object().member("parameters", object.model->parameters().elements());
    json.member("trainable", trainable).member("slices", network.slices());
    json.key("bytes").begin_object().member("activations", memory.arenas - memory.prepared);
    json.member("prepared", memory.prepared).end();
    add_ledger(json, network.ledger());
    add_tensors(json, *object.model);
    json.newline(1).key("load").begin_object().member("rays_differ", load.rays_differ);
    json.member("rays_taken", load.rays_taken).key("copied").list(load.copied);
    json.key("widened").list(load.widened).key("fresh").list(load.fresh);
    json.key("left_out").list(load.left_out).end();
    json.newline(1).key("config").raw(config::config_text(network.config())).end();
    return json.text();
}

/// A live model and its device, locked while `body` runs. No tensor of the model is mapped.
template <class Body>
splat_result unmapped(splat_model model, Body&& body) {
    return api::locked(model, [&](auto& object) -> Status {
        SPLAT_TRY(object.model->check_unmapped());
        return body(object);
    });
}

Result<scene::Gaussians> gaussians_of(api::ModelObject& object, std::uint32_t index) {
    SPLAT_TRY(api::expect_ran(object));
    if (index >= object.objects)
        return invalid("object is %u, expected less than %u, the objects of the model", index,
                       object.objects);
    SPLAT_ASSIGN(gaussians::Downloaded read,
                 gaussians::download(*object.context, object.model->set_desc(),
                                     object.model->set(index), true));
    return std::move(read.gaussians);
}

}  // namespace

Result<config::Precision> api::precision_of(splat_precision precision, const char* field) {
    switch (precision) {
        case 0:
        case SPLAT_PRECISION_BALANCED:
            return config::Precision::kBalanced;
        case SPLAT_PRECISION_STRICT:
            return config::Precision::kStrict;
        case SPLAT_PRECISION_FAST:
            return config::Precision::kFast;
        default:
            return invalid("%s is %d, expected 0 to %d", field, precision, SPLAT_PRECISION_FAST);
    }
}

splat_result splat_model_create(splat_device device, const splat_model_desc* desc,
                                splat_model* model) {
    const auto make = [&](const auto& owner) -> api::Models::Made {
        SPLAT_TRY(api::check_desc(desc, SPLAT_MODEL_GRADIENTS | SPLAT_MODEL_TRAINING |
                                            SPLAT_MODEL_LOW_MEMORY | SPLAT_MODEL_RECOMPUTE |
                                            SPLAT_MODEL_INPUT_GRADIENTS));
        constexpr std::uint32_t kBackward = SPLAT_MODEL_RECOMPUTE | SPLAT_MODEL_INPUT_GRADIENTS;
        if ((desc->flags & kBackward) != 0 && (desc->flags & SPLAT_MODEL_GRADIENTS) == 0)
            return invalid(
                "splat_model_desc.flags is %#x: SPLAT_MODEL_RECOMPUTE and "
                "SPLAT_MODEL_INPUT_GRADIENTS need SPLAT_MODEL_GRADIENTS",
                desc->flags);
        model::ModelOptions options;
        SPLAT_ASSIGN(options.build.precision,
                     api::precision_of(desc->precision, "splat_model_desc.precision"));
        SPLAT_ASSIGN(const config::ModelConfig config, config_of(desc->config));
        if (desc->objects > 4096)
            return invalid("splat_model_desc.objects is %u, expected at most 4096", desc->objects);
        options.objects = desc->objects == 0 ? 1 : desc->objects;
        options.gradients = (desc->flags & SPLAT_MODEL_GRADIENTS) != 0;
        options.build.training = (desc->flags & SPLAT_MODEL_TRAINING) != 0;
        options.keep_prepared = (desc->flags & SPLAT_MODEL_LOW_MEMORY) == 0;
        options.recompute = (desc->flags & SPLAT_MODEL_RECOMPUTE) != 0;
        options.input_gradient = (desc->flags & SPLAT_MODEL_INPUT_GRADIENTS) != 0;
        SPLAT_TRY(owner->test(api::kNetworkKernels |
                              (options.gradients ? api::kNetworkGradientKernels : 0U)));
        auto object = std::make_shared<api::ModelObject>(owner->context);
        object->objects = options.objects;
        object->flags = desc->flags;
        const std::lock_guard lock(object->context->mutex);
        SPLAT_ASSIGN(object->model, model::Model::create(*object->context, config, options));
        return object;
    };
    return api::create_of(device, model, make);
}

splat_result splat_model_init(splat_model model, uint64_t seed) {
    return unmapped(model, [&](api::ModelObject& object) { return object.model->init(seed); });
}

splat_result splat_model_load(splat_model model, splat_weights weights, uint32_t flags) {
    return unmapped(model, [&](api::ModelObject& object) -> Status {
        SPLAT_ASSIGN(const auto file, api::weights_to_use(weights, "weights"));
        SPLAT_TRY(api::check_flags(flags, 2 * SPLAT_LOAD_FROM_PLANE - 1));
        model::LoadReport report = object.load.get();
        const auto loaded = [&](Status status) {
            object.load.set(std::move(report));
            return status;
        };
        if ((flags & SPLAT_LOAD_ADAPTERS) != 0) {
            if (flags != SPLAT_LOAD_ADAPTERS)
                return invalid("flags is %#x, expected SPLAT_LOAD_ADAPTERS alone", flags);
            return loaded(model::load_adapters(*object.model, file->file, report));
        }
        SPLAT_TRY(predict::expect_network(file->file.tensors, object.model->config()));
        model::LoadOptions options;
        options.graft = (flags & SPLAT_LOAD_GRAFT) != 0;
        options.take_rays = (flags & SPLAT_LOAD_TAKE_RAYS) != 0;
        options.source = {
            (flags & SPLAT_LOAD_FROM_DEPTH) != 0, (flags & SPLAT_LOAD_FROM_NORMAL) != 0,
            (flags & SPLAT_LOAD_FROM_MASK) != 0, (flags & SPLAT_LOAD_FROM_PLANE) != 0};
        return loaded(model::load_state(*object.model, file->file.tensors, options, report));
    });
}

splat_result splat_model_store(splat_model model, splat_weights* weights) {
    return unmapped(model, [&](api::ModelObject& object) -> Status {
        SPLAT_TRY(api::require(weights, "weights"));
        auto made = std::make_shared<api::WeightsObject>();
        SPLAT_ASSIGN(made->file.tensors, model::save_state(*object.model));
        made->from = "model";
        *weights = api::Weights::add(std::move(made));
        return {};
    });
}

splat_result splat_model_export(splat_model model, splat_export what, splat_weights* weights) {
    return unmapped(model, [&](api::ModelObject& object) -> Status {
        SPLAT_TRY(api::require(weights, "weights"));
        if (what != SPLAT_EXPORT_ADAPTERS && what != SPLAT_EXPORT_MERGED)
            return invalid("what is %d, expected SPLAT_EXPORT_*", what);
        auto made = std::make_shared<api::WeightsObject>();
        SPLAT_ASSIGN(made->file, model::save_adapters(*object.model));
        if (what == SPLAT_EXPORT_MERGED) {
            SPLAT_ASSIGN(const io::NamedTensors state, model::save_state(*object.model));
            const auto alpha = static_cast<double>(object.model->config().lora.alpha);
            SPLAT_ASSIGN(made->file.tensors,
                         model::merge_adapters(state, made->file.tensors, alpha, 1));
            made->file.metadata.clear();
        }
        made->from = "model";
        *weights = api::Weights::add(std::move(made));
        return {};
    });
}

splat_result splat_model_report(splat_model model, char* buffer, size_t capacity, size_t* needed) {
    return api::report(model, buffer, capacity, needed,
                       [](auto& object) { return report_of(object); });
}

splat_result splat_model_scene(splat_model model, uint32_t object, splat_scene* scene) {
    return unmapped(model, [&](api::ModelObject& from) -> Status {
        SPLAT_TRY(api::require(scene, "scene"));
        auto made = std::make_shared<api::SceneObject>();
        SPLAT_ASSIGN(made->gaussians, gaussians_of(from, object));
        *scene = api::Scenes::add(std::move(made));
        return {};
    });
}
