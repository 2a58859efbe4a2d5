#include <algorithm>
#include <cstddef>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "api/model/model_tensors.h"
#include "api/model/network_arrays.h"
#include "core/finite.h"

using namespace splat;

namespace {

Status expect_no_arrays(const char* type, std::initializer_list<const void*> arrays) {
    const bool given =
        std::ranges::any_of(arrays, [](const void* array) { return array != nullptr; });
    if (!given) return {};
    return invalid("%s.flags has SPLAT_PASS_TENSORS, but an array is given; expected NULL", type);
}

/// The planes of N images from the caller's pictures.
Result<std::vector<float>> planes_of_pictures(const splat_model_input& input,
                                              const config::ModelConfig& c, std::size_t images) {
    const std::size_t pixels = std::size_t{c.resolution} * c.resolution;
    const std::size_t all = images * c.input_channels() * pixels;
    std::vector<float> planes;
    std::uint32_t channels = 0;  // channels of the image so far
    for (std::uint32_t i = 0; i < input.picture_count; ++i) {
        const std::string what = format("splat_model_input.pictures[%u]", i);
        SPLAT_ASSIGN(const api::ImageView view,
                     api::image_to_read(&input.pictures[i], what.c_str()));
        SPLAT_TRY(
            api::check_image_size(view, what.c_str(), c.resolution, c.resolution, view.channels));
        channels += view.channels;
        if (channels > c.input_channels())
            return error(Code::kShape,
                         "%s has %u channels, expected at most %u: its image has %u in all",
                         what.c_str(), view.channels,
                         c.input_channels() - (channels - view.channels), c.input_channels());
        if (channels == c.input_channels()) channels = 0;
        const std::vector<float> part = api::planes_of(view);
        planes.insert(planes.end(), part.begin(), part.end());
    }
    if (planes.size() == all) return planes;
    return error(Code::kShape,
                 "splat_model_input.pictures has %zu planes in %u pictures, expected %zu: %zu "
                 "images of %u channels",
                 planes.size() / pixels, input.picture_count, all / pixels, images,
                 c.input_channels());
}

/// The caller's arrays in the form of the model.
struct HostInput {
    std::vector<float> planes;
    model::ModelInput input;
};

Status take_images(const splat_model_input& from, const config::ModelConfig& c, std::size_t images,
                   HostInput& to) {
    if (from.pictures == nullptr && from.picture_count > 0)
        return invalid("splat_model_input.pictures is NULL, but picture_count is %u",
                       from.picture_count);
    if (from.pictures == nullptr) {
        SPLAT_TRY(api::require(from.images, "splat_model_input.images"));
        SPLAT_ASSIGN(
            to.input.images,
            api::host_array("splat_model_input", "images", {from.images, from.images_count},
                            {images, c.input_channels(), c.resolution, c.resolution}));
        return {};
    }
    if (from.images != nullptr)
        return invalid("splat_model_input.images and pictures are both given, expected one");
    SPLAT_ASSIGN(to.planes, planes_of_pictures(from, c, images));
    to.input.images = to.planes;
    return {};
}

Status take(const splat_model_input& from, const config::ModelConfig& c, std::uint32_t objects,
            const model::IdentityPoses& identity, HostInput& to) {
    const std::size_t n = std::size_t{objects} * c.views;
    SPLAT_TRY(take_images(from, c, n, to));
    if ((from.view_to_world == nullptr) != (from.quaternions == nullptr))
        return invalid(
            "splat_model_input.view_to_world and quaternions: one is NULL, expected both "
            "or neither");
    SPLAT_TRY(api::check_network_arrays({"splat_model_input", from.focals, from.embedding,
                                         from.tokens, from.channels, from.objects},
                                        c, objects));
    const auto array = [](const char* name, const float* values, std::uint64_t count,
                          const std::vector<std::uint64_t>& dims) {
        return api::host_array("splat_model_input", name, {values, count}, dims);
    };
    model::ModelInput& input = to.input;
    SPLAT_ASSIGN(input.view_to_world,
                 array("view_to_world", from.view_to_world, from.view_to_world_count, {n, 4, 4}));
    SPLAT_ASSIGN(input.quaternions,
                 array("quaternions", from.quaternions, from.quaternions_count, {n, 4}));
    if (from.view_to_world == nullptr) {
        input.view_to_world = identity.view_to_world;
        input.quaternions = identity.quaternions;
    }
    SPLAT_ASSIGN(input.focals, array("focals", from.focals, from.focals_count, {n, 2}));
    SPLAT_ASSIGN(input.embedding, array("embedding", from.embedding, from.embedding_count,
                                        {n, c.embedding_length()}));
    SPLAT_ASSIGN(input.tokens,
                 array("tokens", from.tokens, from.tokens_count, {n, c.token_dim, c.tokens}));
    return {};
}

Status run_model(api::ModelObject& object, const splat_model_input& from) {
    model::Model& network = *object.model;
    const config::ModelConfig& c = network.config();
    SPLAT_TRY(api::check_flags(from.flags, SPLAT_PASS_TENSORS, "splat_model_input.flags"));
    SPLAT_TRY(network.check_unmapped());
    vk::BatchScope scope = network.one_list();
    if ((from.flags & SPLAT_PASS_TENSORS) != 0) {
        SPLAT_TRY(expect_no_arrays(
            "splat_model_input", {from.images, from.pictures, from.view_to_world, from.quaternions,
                                  from.focals, from.embedding, from.tokens}));
        SPLAT_TRY(network.use_tensors(from.seed, from.step));
    } else {
        const model::IdentityPoses identity(std::size_t{object.objects} * c.views);
        HostInput host;
        SPLAT_TRY(take(from, c, object.objects, identity, host));
        host.input.seed = from.seed;
        host.input.step = from.step;
        SPLAT_TRY(network.set_input(host.input));
    }
    object.ran = false;
    SPLAT_TRY(network.forward());
    SPLAT_TRY(scope.finish());
    object.ran = true;
    return {};
}

/// Check all arrays, then write them, with zeros for those that are NULL.
Status write_gradients(api::ModelObject& object, const splat_model_gradients& from) {
    const std::vector<api::ModelOutput> outputs = api::model_outputs(*object.model);
    const api::HostArray given[5] = {{from.means, from.means_count},
                                     {from.opacities, from.opacities_count},
                                     {from.scales, from.scales_count},
                                     {from.rotations, from.rotations_count},
                                     {from.sh, from.sh_count}};
    std::span<const float> arrays[5];
    for (std::size_t i = 0; i < 5; ++i) {
        const Shape& shape = outputs[i].shape;
        std::vector<std::uint64_t> dims;
        for (std::uint32_t axis = 0; axis < shape.rank(); ++axis) dims.push_back(shape[axis]);
        SPLAT_ASSIGN(arrays[i],
                     api::host_array("splat_model_gradients", outputs[i].name, given[i], dims));
        if (const std::size_t bad = find_not_finite(arrays[i]); bad < arrays[i].size())
            return invalid("splat_model_gradients.%s holds %g at %zu, expected finite numbers",
                           outputs[i].name, static_cast<double>(arrays[i][bad]), bad);
    }
    SPLAT_ASSIGN(const model::Model::Outputs gradients, object.model->output_gradients());
    for (std::size_t i = 0; i < 5; ++i) {
        const vk::BufferView& to = gradients.*outputs[i].rows;
        SPLAT_TRY(arrays[i].empty()
                      ? object.context->fill(to, 0)
                      : object.context->write(to, arrays[i].data(), arrays[i].size_bytes()));
    }
    return {};
}

}  // namespace

splat_result splat_model_forward(splat_model model, const splat_model_input* input) {
    return api::locked(model, [&](auto& object) -> Status {
        splat_model_input taken{};
        SPLAT_TRY(api::take_input(input, "input", taken));
        return run_model(object, taken);
    });
}

splat_result splat_model_backward(splat_model model, const splat_model_gradients* gradients) {
    return api::locked(model, [&](auto& object) -> Status {
        splat_model_gradients taken{};
        SPLAT_TRY(api::take_input(gradients, "gradients", taken));
        SPLAT_TRY(api::check_flags(taken.flags, SPLAT_PASS_TENSORS, "splat_model_gradients.flags"));
        SPLAT_TRY(api::expect_ran(object));
        model::Model& network = *object.model;
        if (!network.has_gradients())
            return bad_state("the model was created without SPLAT_MODEL_GRADIENTS");
        SPLAT_TRY(network.check_unmapped());
        vk::BatchScope scope = network.one_list();
        if ((taken.flags & SPLAT_PASS_TENSORS) != 0)
            SPLAT_TRY(expect_no_arrays(
                "splat_model_gradients",
                {taken.means, taken.opacities, taken.scales, taken.rotations, taken.sh}));
        else
            SPLAT_TRY(write_gradients(object, taken));
        Status done = network.backward();
        if (done.ok()) done = scope.finish();
        if (done.code() != Code::kInvalidState) object.has_input_gradients = done.ok();
        return done;
    });
}

splat_result splat_model_zero_gradients(splat_model model) {
    return api::locked(model, [&](auto& object) -> Status {
        SPLAT_TRY(object.model->check_unmapped());
        return object.model->parameters().zero_gradients();
    });
}

splat_result splat_model_read(splat_model model, const char* name, float* values, size_t bytes) {
    return api::locked(model, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(name, "name", values, "values"));
        SPLAT_ASSIGN(api::ModelTensor found,
                     api::find_model_tensor(*object.model, object.objects, name));
        if (found.of_pass) SPLAT_TRY(api::expect_ran(object));
        if (found.of_backward && !object.has_input_gradients)
            return bad_state("'%s': call splat_model_backward first", name);
        const std::size_t needed = found.view.shape.elements() * sizeof(float);
        if (bytes < needed) return invalid("bytes is %zu, but '%s' takes %zu", bytes, name, needed);
        SPLAT_TRY(object.model->check_unmapped());
        SPLAT_TRY(api::bind_model_tensor(*object.model, found));
        return object.context->read(found.view, values, needed);
    });
}

splat_result splat_model_write(splat_model model, const char* name, const float* values,
                               size_t bytes) {
    return api::locked(model, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(name, "name", values, "values"));
        nn::Parameters& parameters = object.model->parameters();
        const nn::Parameter* parameter = parameters.find(name);
        if (parameter == nullptr)
            return not_found("the model has no parameter '%s'; splat_model_ports lists them", name);
        const std::size_t needed = parameter->shape.elements() * sizeof(float);
        if (bytes != needed)
            return error(Code::kShape, "bytes is %zu, but '%s' of shape %s takes %zu", bytes, name,
                         parameter->shape.text().c_str(), needed);
        const std::span<const float> given(values, bytes / sizeof(float));
        if (const std::size_t bad = find_not_finite(given); bad < given.size())
            return invalid("'%s' holds %g at %zu, expected finite numbers", name,
                           static_cast<double>(given[bad]), bad);
        SPLAT_TRY(object.model->check_unmapped());
        return parameters.write(*parameter, given);
    });
}
