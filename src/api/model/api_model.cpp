#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "api/api_guard.h"
#include "api/handles.h"
#include "api/model/network_arrays.h"
#include "config/config_file.h"
#include "core/finite.h"
#include "core/json_writer.h"
#include "model/adapters.h"
#include "scene/activate.h"

using namespace splat;

namespace {

using ModelPointer = std::shared_ptr<api::ModelObject>;

Result<config::PredictorConfig> config_of(const char* text) {
    if (text == nullptr) return config::PredictorConfig();
    SPLAT_ASSIGN(const Config config, read_config(text, "configuration"));
    return config::predictor_config(config);
}

std::string report_of(api::ModelObject& object) {
    const model::Predictor& predictor = *object.predictor;
    std::uint64_t trainable = 0;
    for (const nn::Parameter& parameter : object.predictor->parameters().all())
        if (parameter.trainable) trainable += parameter.shape.elements();
    const nn::ExecutorMemory& memory = predictor.executor().memory();
    const model::LoadReport& load = object.load;
    JsonWriter json;
    json.begin_object().member("parameters", object.predictor->parameters().elements());
    json.member("trainable", trainable).member("slices", predictor.slices());
    json.key("bytes").begin_object().member("activations", memory.arenas - memory.prepared);
    json.member("prepared", memory.prepared).end();
    json.newline(1).key("load").begin_object().member("rays_differ", load.rays_differ);
    json.member("rays_taken", load.rays_taken).key("copied").list(load.copied);
    json.key("widened").list(load.widened).key("fresh").list(load.fresh);
    json.key("left_out").list(load.left_out).end();
    json.newline(1).key("config").raw(config::config_text(predictor.config())).end();
    return json.text();
}

/// A live model and its device, locked while `body` runs.
template <class Body>
splat_result locked(splat_model model, Body&& body) {
    return api::guarded([&] { return api::use<api::Models>(model, "model", body); });
}

/// Identity poses where the caller gives none.
struct Poses {
    std::vector<float> matrices;
    std::vector<float> quaternions;

    explicit Poses(std::size_t images) : matrices(16 * images), quaternions(4 * images) {
        for (std::size_t i = 0; i < images; ++i) {
            for (std::size_t axis = 0; axis < 4; ++axis) matrices[16 * i + 5 * axis] = 1;
            quaternions[4 * i] = 1;
        }
    }
};

Status run(api::ModelObject& object, const splat_model_input& input) {
    const config::PredictorConfig& c = object.predictor->config();
    const std::size_t images = std::size_t{object.objects} * c.views;
    const std::size_t pixels = std::size_t{c.resolution} * c.resolution;
    SPLAT_TRY(api::require(input.images, "splat_model_input.images"));
    if ((input.view_to_world == nullptr) != (input.quaternions == nullptr))
        return error(Code::kInvalidArgument,
                     "splat_model_input.view_to_world and quaternions: one is NULL, expected both "
                     "or neither");
    SPLAT_TRY(api::check_network_arrays({"splat_model_input", input.focals, input.embedding,
                                         input.tokens, input.channels, input.objects},
                                        c, object.objects));
    const Poses identity(images);
    const auto span = [](const float* values, std::size_t count) {
        return values == nullptr ? std::span<const float>() : std::span(values, count);
    };
    model::PredictorInput given;
    given.images = span(input.images, images * c.input_channels() * pixels);
    given.view_to_world = input.view_to_world == nullptr ? std::span<const float>(identity.matrices)
                                                         : span(input.view_to_world, 16 * images);
    given.quaternions = input.quaternions == nullptr ? std::span<const float>(identity.quaternions)
                                                     : span(input.quaternions, 4 * images);
    given.focals = span(input.focals, 2 * images);
    given.embedding = span(input.embedding, images * c.embedding_length());
    given.tokens = span(input.tokens, images * c.token_dim * c.tokens);
    given.seed = input.seed;
    given.step = input.step;
    SPLAT_TRY(object.predictor->set_input(given));
    object.ran = false;
    SPLAT_TRY(object.predictor->forward());
    object.ran = true;
    return {};
}

Status expect_ran(const api::ModelObject& object) {
    if (object.ran) return {};
    return error(Code::kInvalidState, "the model has not run: call splat_model_forward first");
}

constexpr std::pair<model::Predictor::Input, const char*> kInputs[] = {
    {model::Predictor::Input::kImages, "grad:images"},
    {model::Predictor::Input::kEmbedding, "grad:embedding"},
    {model::Predictor::Input::kTokens, "grad:tokens"}};

/// Find a result, a parameter or a gradient by its name.
Result<vk::BufferView> find_view(api::ModelObject& object, const std::string& name) {
    const auto outputs = object.predictor->outputs();
    const std::pair<const char*, vk::BufferView> results[] = {
        {"means", outputs.means},   {"opacities", outputs.opacities},
        {"scales", outputs.scales}, {"rotations", outputs.rotations},
        {"sh", outputs.sh},         {"raw", object.predictor->raw_output()}};
    for (const auto& [known, view] : results)
        if (name == known) {
            SPLAT_TRY(expect_ran(object));
            return view;
        }
    const bool gradient = name.starts_with("grad:");
    const nn::Parameter* parameter =
        object.predictor->parameters().find(gradient ? name.substr(5) : name);
    if (parameter == nullptr)
        return error(Code::kInvalidArgument,
                     "'%s' is not a result (means, opacities, scales, rotations, sh, raw), a "
                     "parameter, or a gradient ('grad:' and a parameter's name, images, "
                     "embedding or tokens)",
                     name.c_str());
    if (!gradient) return parameter->value;
    if (parameter->grad.block == nullptr)
        return error(Code::kInvalidState, "parameter '%s' has no gradient: %s", name.c_str() + 5,
                     parameter->trainable ? "the model was made without SPLAT_MODEL_GRADIENTS"
                                          : "the configuration does not train it");
    return parameter->grad;
}

Status read_view(api::ModelObject& object, const vk::BufferView& view, std::vector<float>& values) {
    values.resize(view.shape.elements());
    return object.context->read(view, values.data(), values.size() * sizeof(float));
}

/// The values of object `i`.
std::vector<float> part(const std::vector<float>& all, std::uint32_t objects, std::uint32_t i) {
    const auto count = static_cast<std::ptrdiff_t>(all.size() / objects);
    return {all.begin() + i * count, all.begin() + (i + 1) * count};
}

Result<scene::Gaussians> gaussians_of(api::ModelObject& object, std::uint32_t index) {
    SPLAT_TRY(expect_ran(object));
    if (index >= object.objects)
        return error(Code::kInvalidArgument,
                     "object is %u, expected less than %u, the objects of the model", index,
                     object.objects);
    const auto outputs = object.predictor->outputs();
    std::vector<float> means, opacities, scales, rotations, sh;
    SPLAT_TRY(read_view(object, outputs.means, means));
    SPLAT_TRY(read_view(object, outputs.opacities, opacities));
    SPLAT_TRY(read_view(object, outputs.scales, scales));
    SPLAT_TRY(read_view(object, outputs.rotations, rotations));
    SPLAT_TRY(read_view(object, outputs.sh, sh));
    scene::Gaussians made;
    made.sh_degree = object.predictor->config().sh_degree;
    made.means = part(means, object.objects, index);
    made.rotations = part(rotations, object.objects, index);
    made.sh = part(sh, object.objects, index);
    // Scenes hold logarithms and logits, as files of Gaussians do.
    made.log_scales = part(scales, object.objects, index);
    // exp() of the network's output may be 0 in float32. Such a flat Gaussian is still drawn.
    constexpr float kLeastScale = std::numeric_limits<float>::min();
    for (float& scale : made.log_scales) scale = std::log(std::max(scale, kLeastScale));
    made.opacity_logits = part(opacities, object.objects, index);
    for (float& opacity : made.opacity_logits)
        opacity = static_cast<float>(scene::logit_of(static_cast<double>(opacity)));
    return made;
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
            return error(Code::kInvalidArgument, "%s is %d, expected 0 to %d", field, precision,
                         SPLAT_PRECISION_FAST);
    }
}

splat_result splat_model_create(splat_device device, const splat_model_desc* desc,
                                splat_model* model) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto owner, api::Devices::find(device, "device"));
        SPLAT_TRY(api::require(model, "model"));
        SPLAT_TRY(api::check_desc(desc, "splat_model_desc", sizeof(splat_model_desc),
                                  SPLAT_MODEL_GRADIENTS | SPLAT_MODEL_TRAINING |
                                      SPLAT_MODEL_LOW_MEMORY | SPLAT_MODEL_RECOMPUTE |
                                      SPLAT_MODEL_INPUT_GRADIENTS));
        constexpr std::uint32_t kBackward = SPLAT_MODEL_RECOMPUTE | SPLAT_MODEL_INPUT_GRADIENTS;
        if ((desc->flags & kBackward) != 0 && (desc->flags & SPLAT_MODEL_GRADIENTS) == 0)
            return error(Code::kInvalidArgument,
                         "splat_model_desc.flags is %#x: SPLAT_MODEL_RECOMPUTE and "
                         "_INPUT_GRADIENTS need SPLAT_MODEL_GRADIENTS",
                         desc->flags);
        model::PredictorOptions options;
        SPLAT_ASSIGN(options.build.precision,
                     api::precision_of(desc->precision, "splat_model_desc.precision"));
        SPLAT_ASSIGN(const config::PredictorConfig config, config_of(desc->config));
        if (desc->objects > 4096)
            return error(Code::kInvalidArgument,
                         "splat_model_desc.objects is %u, expected at most 4096", desc->objects);
        options.objects = desc->objects == 0 ? 1 : desc->objects;
        options.gradients = (desc->flags & SPLAT_MODEL_GRADIENTS) != 0;
        options.build.training = (desc->flags & SPLAT_MODEL_TRAINING) != 0;
        options.keep_prepared = (desc->flags & SPLAT_MODEL_LOW_MEMORY) == 0;
        options.recompute = (desc->flags & SPLAT_MODEL_RECOMPUTE) != 0;
        options.input_gradient = (desc->flags & SPLAT_MODEL_INPUT_GRADIENTS) != 0;
        auto object = std::make_shared<api::ModelObject>(owner->context);
        object->objects = options.objects;
        {
            const std::lock_guard lock(object->context->mutex);
            SPLAT_ASSIGN(object->predictor,
                         model::Predictor::create(*object->context, config, options));
        }  // unlocked: if add() throws, the object is destroyed, which locks
        *model = api::Models::add(std::move(object));
        return {};
    });
}

splat_result splat_model_init(splat_model model, uint64_t seed) {
    return locked(model, [&](api::ModelObject& object) { return object.predictor->init(seed); });
}

splat_result splat_model_load(splat_model model, splat_weights weights, uint32_t flags) {
    return locked(model, [&](api::ModelObject& object) -> Status {
        SPLAT_ASSIGN(const auto file, api::weights_to_use(weights, "weights"));
        constexpr std::uint32_t kKnown = 2 * SPLAT_LOAD_ADAPTERS - 1;
        if ((flags & ~kKnown) != 0)
            return error(Code::kInvalidArgument, "flags has unknown bits %#x", flags & ~kKnown);
        if ((flags & SPLAT_LOAD_ADAPTERS) != 0) {
            if (flags != SPLAT_LOAD_ADAPTERS)
                return error(Code::kInvalidArgument,
                             "flags is %#x, expected SPLAT_LOAD_ADAPTERS alone", flags);
            return model::load_adapters(*object.predictor, file->file, object.load);
        }
        model::LoadOptions options;
        options.graft = (flags & SPLAT_LOAD_GRAFT) != 0;
        options.take_rays = (flags & SPLAT_LOAD_TAKE_RAYS) != 0;
        options.source = {(flags & SPLAT_LOAD_FROM_DEPTH) != 0,
                          (flags & SPLAT_LOAD_FROM_NORMAL) != 0,
                          (flags & SPLAT_LOAD_FROM_MASK) != 0};
        return model::load_state(*object.predictor, file->file.tensors, options, object.load);
    });
}

splat_result splat_model_store(splat_model model, splat_weights* weights) {
    return locked(model, [&](api::ModelObject& object) -> Status {
        SPLAT_TRY(api::require(weights, "weights"));
        auto made = std::make_shared<api::WeightsObject>();
        SPLAT_ASSIGN(made->file.tensors, model::save_state(*object.predictor));
        made->report = api::weights_report(made->file, "model");
        *weights = api::Weights::add(std::move(made));
        return {};
    });
}

splat_result splat_model_export(splat_model model, splat_export what, splat_weights* weights) {
    return locked(model, [&](api::ModelObject& object) -> Status {
        SPLAT_TRY(api::require(weights, "weights"));
        if (what != SPLAT_EXPORT_ADAPTERS && what != SPLAT_EXPORT_MERGED)
            return error(Code::kInvalidArgument, "what is %d, expected SPLAT_EXPORT_*", what);
        auto made = std::make_shared<api::WeightsObject>();
        SPLAT_ASSIGN(made->file, model::save_adapters(*object.predictor));
        if (what == SPLAT_EXPORT_MERGED) {
            SPLAT_ASSIGN(const io::NamedTensors state, model::save_state(*object.predictor));
            const auto alpha = static_cast<double>(object.predictor->config().lora.alpha);
            SPLAT_ASSIGN(made->file.tensors,
                         model::merge_adapters(state, made->file.tensors, alpha, 1));
            made->file.metadata.clear();
        }
        made->report = api::weights_report(made->file, "model");
        *weights = api::Weights::add(std::move(made));
        return {};
    });
}

splat_result splat_model_report(splat_model model, char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&](auto give) {
        return api::use<api::Models>(
            model, "model", [&](api::ModelObject& object) { return give(report_of(object)); });
    });
}

splat_result splat_model_forward(splat_model model, const splat_model_input* input) {
    return locked(model, [&](api::ModelObject& object) -> Status {
        splat_model_input taken{};
        SPLAT_TRY(api::take_input(input, "input", "splat_model_input",
                                  offsetof(splat_model_input, channels), taken));
        return run(object, taken);
    });
}

splat_result splat_model_read(splat_model model, const char* name, float* values, size_t bytes) {
    return locked(model, [&](api::ModelObject& object) -> Status {
        SPLAT_TRY(api::require(name, "name"));
        SPLAT_TRY(api::require(values, "values"));
        const auto check_bytes = [&](std::size_t needed) -> Status {
            if (bytes >= needed) return {};
            return error(Code::kInvalidArgument, "bytes is %zu, but '%s' takes %zu", bytes, name,
                         needed);
        };
        for (const auto& [input, known] : kInputs) {
            if (std::string_view(name) != known) continue;
            SPLAT_ASSIGN(const std::vector<float> gradient,
                         object.predictor->input_gradient(input));
            if (!object.has_input_gradients)
                return error(Code::kInvalidState, "'%s': call splat_model_backward first", name);
            SPLAT_TRY(check_bytes(gradient.size() * sizeof(float)));
            std::copy(gradient.begin(), gradient.end(), values);
            return {};
        }
        SPLAT_ASSIGN(const vk::BufferView view, find_view(object, name));
        const std::size_t needed = view.shape.elements() * sizeof(float);
        SPLAT_TRY(check_bytes(needed));
        return object.context->read(view, values, needed);
    });
}

splat_result splat_model_write(splat_model model, const char* name, const float* values,
                               size_t bytes) {
    return locked(model, [&](api::ModelObject& object) -> Status {
        SPLAT_TRY(api::require(name, "name"));
        SPLAT_TRY(api::require(values, "values"));
        nn::Parameters& parameters = object.predictor->parameters();
        const nn::Parameter* parameter = parameters.find(name);
        if (parameter == nullptr)
            return error(Code::kInvalidArgument,
                         "the model has no parameter '%s'; splat_model_store lists them", name);
        const std::size_t needed = parameter->shape.elements() * sizeof(float);
        if (bytes != needed)
            return error(Code::kShape, "bytes is %zu, but '%s' of shape %s takes %zu", bytes, name,
                         parameter->shape.text().c_str(), needed);
        const std::span<const float> given(values, bytes / sizeof(float));
        if (const std::size_t bad = find_not_finite(given); bad < given.size())
            return error(Code::kInvalidArgument, "'%s' holds %g at %zu, expected finite numbers",
                         name, static_cast<double>(given[bad]), bad);
        return parameters.write(*parameter, given);
    });
}

splat_result splat_model_scene(splat_model model, uint32_t object, splat_scene* scene) {
    return locked(model, [&](api::ModelObject& from) -> Status {
        SPLAT_TRY(api::require(scene, "scene"));
        auto made = std::make_shared<api::SceneObject>();
        SPLAT_ASSIGN(made->gaussians, gaussians_of(from, object));
        *scene = api::Scenes::add(std::move(made));
        return {};
    });
}

splat_result splat_model_backward(splat_model model, const float* const gradients[5]) {
    return locked(model, [&](api::ModelObject& object) -> Status {
        SPLAT_TRY(api::require(gradients, "gradients"));
        SPLAT_TRY(expect_ran(object));
        if (!object.predictor->has_gradients())
            return error(Code::kInvalidState,
                         "the model was created without SPLAT_MODEL_GRADIENTS");
        const auto outputs = object.predictor->output_gradients();
        const vk::BufferView views[5] = {outputs.means, outputs.opacities, outputs.scales,
                                         outputs.rotations, outputs.sh};
        constexpr const char* kNames[5] = {"means", "opacities", "scales", "rotations", "sh"};
        for (std::size_t i = 0; i < 5; ++i) {  // all are checked before any is written
            if (gradients[i] == nullptr) continue;
            const std::span<const float> values(gradients[i], views[i].shape.elements());
            if (const std::size_t bad = find_not_finite(values); bad < values.size())
                return error(Code::kInvalidArgument,
                             "gradients[%zu], of '%s', holds %g at %zu, expected finite numbers", i,
                             kNames[i], static_cast<double>(values[bad]), bad);
        }
        for (std::size_t i = 0; i < 5; ++i) {
            const std::uint64_t bytes = views[i].shape.elements() * sizeof(float);
            SPLAT_TRY(gradients[i] == nullptr
                          ? object.context->fill(views[i], 0)
                          : object.context->write(views[i], gradients[i], bytes));
        }
        const Status done = object.predictor->backward();
        if (done.code() != Code::kInvalidState) object.has_input_gradients = done.ok();
        return done;
    });
}

splat_result splat_model_zero_gradients(splat_model model) {
    return locked(model, [&](api::ModelObject& object) {
        return object.predictor->parameters().zero_gradients();
    });
}

splat_result splat_model_destroy(splat_model model) {
    return api::destroy<api::Models>(model, "model");
}
