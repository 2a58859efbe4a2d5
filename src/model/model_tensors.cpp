#include "model/camera_embedding.h"
#include "model/model.h"

namespace splat::model {
namespace {

/// The graph's tokens are images of width 1.
vk::BufferView without_last_axis(vk::BufferView view) {
    view.shape = {view.shape[0], view.shape[1], view.shape[2]};
    return view;
}

}  // namespace

std::vector<Model::Port> Model::inputs() const {
    const std::uint32_t n = images();
    const std::uint32_t r = config_.resolution;
    const bool graded = options_.gradients && options_.input_gradient;
    std::vector<Port> ports = {{"images", {n, config_.image_channels(), r, r}, false, graded},
                               {"view_to_world", {n, 4, 4}, true, false},
                               {"quaternions", {n, 4}, true, false}};
    if (focal_ != nn::kNoValue) ports.push_back({"focals", {n, 2}, false, false});
    if (config_.origin_distance) ports.push_back({"origin_distance", {n}, false, false});
    if (config_.positions == kHeadInputDepth) ports.push_back({"depths", {n, r, r}, false, false});
    if (config_.embedding == Embedding::kCustom)
        ports.push_back({"embedding", {n, config_.embedding_length()}, false, graded});
    if (tokens_ != nn::kNoValue)
        ports.push_back({"tokens", {n, config_.token_dim, config_.tokens}, false, graded});
    return ports;
}

Result<vk::BufferView> Model::input_tensor(std::string_view name) {
    std::string known;
    for (const Port& port : inputs()) known += std::string(" ") + port.name;
    const std::pair<const char*, nn::ValueId> all[] = {
        {"images", image_},
        {"view_to_world", view_to_world_},
        {"focals", focal_},
        {"quaternions", quaternion_},
        {"tokens", tokens_},
        {config_.origin_distance ? "origin_distance" : "depths", origin_},
        {"embedding", config_.embedding == Embedding::kCustom ? embedding_ : nn::kNoValue}};
    for (const auto& [input_name, id] : all) {
        if (name != input_name || id == nn::kNoValue) continue;
        SPLAT_TRY(start_inputs());
        return id == tokens_ ? without_last_axis(input(id)) : input(id);
    }
    return invalid("'%s' is not an input of this model:%s", std::string(name).c_str(),
                   known.c_str());
}

/// Zeros, identity poses, and focal lengths of R pixels where the caller has given nothing.
Status Model::start_inputs() {
    if (input_given_) return {};
    const std::size_t n = images();
    const std::size_t pixels = std::size_t{config_.resolution} * config_.resolution;
    const std::vector<float> planes(n * config_.input_channels() * pixels);
    const IdentityPoses poses(n);
    const std::vector<float> focals(2 * n, static_cast<float>(config_.resolution));
    const std::vector<float> embedding(n * config_.embedding_length());
    const std::vector<float> tokens(n * config_.token_dim * config_.tokens);
    return set_input({.images = planes,
                      .view_to_world = poses.view_to_world,
                      .quaternions = poses.quaternions,
                      .focals = focals,
                      .embedding = embedding,
                      .tokens = tokens});
}

Status Model::use_tensors(std::uint64_t seed, std::uint32_t step) {
    SPLAT_TRY(start_inputs());
    SPLAT_TRY(check_unmapped());
    input_changed_ = true;
    if (config_.embedding == Embedding::kPose) {
        std::vector<float> poses(std::size_t{16} * images());
        SPLAT_TRY(context_.read(input(view_to_world_), poses.data(), poses.size() * sizeof(float)));
        const std::vector<float> scalars = pose_scalars(poses);
        SPLAT_TRY(write_input(embedding_, std::as_bytes(std::span(scalars))));
    }
    return write_counters(seed, step);
}

Status Model::check_unmapped() const {
    if (!outside_->mapped() && !outside_gradients_->mapped() && !parameters_->outside()->mapped())
        return {};
    return bad_state("a tensor of the model is mapped: end that first (splat_tensor_unmap)");
}

Result<vk::BufferView> Model::input_gradient_tensor(Input input) const {
    const bool there =
        options_.gradients && options_.input_gradient &&
        (input == Input::kImages || (input == Input::kTokens && config_.tokens > 0) ||
         (input == Input::kEmbedding && config_.embedding == Embedding::kCustom));
    if (!there)
        return bad_state(
            "model: no gradient of the %s is computed: the model was made without "
            "SPLAT_MODEL_INPUT_GRADIENTS, or its configuration does not have them",
            input == Input::kImages   ? "images"
            : input == Input::kTokens ? "tokens"
                                      : "custom embedding");
    if (input == Input::kEmbedding) return exchanged_gradient_view_;
    return input == Input::kImages ? gradient(image_) : without_last_axis(gradient(tokens_));
}

Result<std::vector<float>> Model::input_gradient(Input input) const {
    SPLAT_ASSIGN(const vk::BufferView view, input_gradient_tensor(input));
    std::vector<float> values(view.shape.elements());
    SPLAT_TRY(context_.read(view, values.data(), values.size() * sizeof(float)));
    return values;
}

}  // namespace splat::model
