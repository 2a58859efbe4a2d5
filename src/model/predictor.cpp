#include "model/predictor.h"

#include <algorithm>

#include "core/finite.h"

namespace splat::model {
namespace {

using nn::kNoValue;
using nn::Layout;
using nn::ValueId;

Status expect_count(const char* name, std::size_t got, std::size_t expected) {
    if (got == expected) return {};
    return error(Code::kShape, "predictor: '%s' has %zu numbers, expected %zu", name, got,
                 expected);
}

Status expect_finite(const char* name, std::span<const float> values) {
    const std::size_t bad = find_not_finite(values);
    if (bad == values.size()) return {};
    return error(Code::kInvalidArgument, "predictor: '%s' holds %g at %zu, expected finite numbers",
                 name, static_cast<double>(values[bad]), bad);
}

/// The published network gets each vector with its halves exchanged.
std::vector<float> exchange_halves(std::span<const float> vectors, std::size_t length) {
    std::vector<float> result(vectors.begin(), vectors.end());
    for (std::size_t at = 0; at + length <= result.size(); at += length)
        std::rotate(result.begin() + static_cast<std::ptrdiff_t>(at),
                    result.begin() + static_cast<std::ptrdiff_t>(at + length / 2),
                    result.begin() + static_cast<std::ptrdiff_t>(at + length));
    return result;
}

}  // namespace

Result<std::unique_ptr<Predictor>> Predictor::create(vk::Context& context,
                                                     const PredictorConfig& config,
                                                     const PredictorOptions& options) {
    SPLAT_TRY(check(config));
    std::unique_ptr<Predictor> made(new Predictor(context, config, options));
    SPLAT_TRY(made->build());
    SPLAT_ASSIGN(nn::Parameters parameters,
                 nn::Parameters::create(context, made->graph_, options.gradients));
    made->parameters_ = std::make_unique<nn::Parameters>(std::move(parameters));
    nn::ExecutorDesc desc;
    desc.outputs = made->outputs_;
    desc.outputs.push_back(made->raw_);
    desc.keep_prepared = options.keep_prepared;
    desc.recompute = options.recompute;
    desc.backward = options.gradients;
    if (options.gradients) {
        desc.grad_outputs = made->outputs_;
        if (options.input_gradient) desc.grad_inputs.push_back(made->image_);
        if (options.input_gradient && config.embedding == Embedding::kCustom)
            desc.grad_inputs.push_back(made->embedding_);
        if (options.input_gradient && config.tokens > 0) desc.grad_inputs.push_back(made->tokens_);
    }
    SPLAT_ASSIGN(made->executor_,
                 nn::Executor::create(context, made->graph_, *made->parameters_, desc));
    SPLAT_TRY(made->set_rays(pixel_rays(config)));
    return made;
}

Status Predictor::build() {
    const std::uint32_t r = config_.resolution;
    const std::uint32_t n = images();
    image_ = graph_.input("images", {n, config_.image_channels(), r, r});
    rays_value_ = graph_.input("rays", {3, r, r}, Layout::kRowMajor);
    view_to_world_ = graph_.input("view_to_world", {n, 4, 4}, Layout::kRowMajor);
    quaternion_ = graph_.input("quaternions", {n, 4}, Layout::kRowMajor);
    if (config_.fov_degrees == 0) focal_ = graph_.input("focals", {n, 2}, Layout::kRowMajor);
    if (config_.origin_distance) origin_ = graph_.input("origin_distance", {n}, Layout::kRowMajor);
    const ValueId embedding = build_embedding();
    if (config_.tokens > 0)
        tokens_ = graph_.input("tokens", {n, config_.token_dim, config_.tokens, 1});
    const bool random =
        options_.build.training && (config_.dropout > 0 || config_.lora.dropout > 0);
    if (random) counter_ = graph_.input("random_counter", {4}, Layout::kRowMajor);

    SongUnet unet(graph_, config_, options_.build);
    raw_ = unet.build(image_, embedding, tokens_, counter_);
    outputs_ = graph_.node("gaussian_head",
                           {raw_, rays_value_, view_to_world_, quaternion_, focal_, origin_},
                           {{"views", std::int64_t{config_.views}},
                            {"znear", static_cast<double>(config_.znear)},
                            {"zfar", static_cast<double>(config_.zfar)},
                            {"sh_degree", std::int64_t{config_.sh_degree}},
                            {"offset", config_.offset},
                            {"isotropic", config_.isotropic}});
    inits_ = unet.inits();
    SPLAT_TRY(graph_.status());
    const auto& values = graph_.values();
    if (!options_.gradients ||
        std::any_of(values.begin(), values.end(), [](const nn::Value& v) { return v.trainable; }))
        return {};
    return error(Code::kInvalidArgument,
                 "configuration: %s leave no parameter to be trained, and gradients are wanted",
                 config_.lora.rank == 0
                     ? "the names of opt.freeze"
                     : "opt.lora_targets, opt.train_with_adapters and opt.freeze");
}

/// The vector that modulates blocks, with its halves exchanged as the published network gets it.
ValueId Predictor::build_embedding() {
    if (config_.embedding == Embedding::kNone) return kNoValue;
    const std::uint32_t dimension = config_.embedding_dim;
    const bool custom = config_.embedding == Embedding::kCustom;
    const std::uint32_t length = config_.embedding_length();
    embedding_ = graph_.input("embedding", {images(), custom ? length : length / dimension});
    if (custom) return embedding_;
    return graph_.op("positional_embedding", {embedding_},
                     {{"dimension", std::int64_t{dimension}}, {"swap_halves", true}});
}

Status Predictor::init(std::uint64_t seed) {
    for (const nn::Parameter& parameter : parameters_->all())
        SPLAT_TRY(
            parameters_->write(parameter, initial_values(config_, inits_.at(parameter.name),
                                                         parameter.name, parameter.shape, seed)));
    return {};
}

Status Predictor::check_put(const Put& put) const {
    SPLAT_TRY(
        expect_count(put.name, put.values.size(), executor_->tensor(put.id).shape.elements()));
    return expect_finite(put.name, put.values);
}

Status Predictor::write_put(const Put& put) {
    return context_.write(executor_->tensor(put.id), put.values.data(), put.values.size_bytes());
}

Status Predictor::set_rays(std::vector<float> rays) {
    const Put put{rays_value_, {}, rays, "ray_dirs"};
    SPLAT_TRY(check_put(put));
    input_changed_ = true;
    SPLAT_TRY(write_put(put));
    rays_ = std::move(rays);
    return {};
}

/// The planes that the network sees, and the origin distance, which is the last plane of each image.
Status Predictor::add_images(std::span<const float> all, std::vector<Put>& puts) const {
    const std::size_t pixels = std::size_t{config_.resolution} * config_.resolution;
    const std::size_t seen = config_.image_channels() * pixels;
    const std::size_t given = config_.input_channels() * pixels;
    SPLAT_TRY(expect_count("images", all.size(), images() * given));
    if (!config_.origin_distance) {
        puts.push_back({image_, {}, all, "images"});
        return {};
    }
    std::vector<float> shown;
    std::vector<float> distances;
    for (std::size_t image = 0; image < images(); ++image) {
        const auto planes = all.subspan(image * given, given);
        const auto last = planes.subspan(seen);
        if (std::any_of(last.begin(), last.end(), [&](float d) { return d != last[0]; }))
            return error(Code::kInvalidArgument,
                         "predictor: the origin distance of image %zu varies, expected one number "
                         "in the whole plane",
                         image);
        shown.insert(shown.end(), planes.begin(),
                     planes.begin() + static_cast<std::ptrdiff_t>(seen));
        distances.push_back(last[0]);
    }
    puts.push_back({image_, std::move(shown), {}, "images"});
    puts.push_back({origin_, std::move(distances), {}, "origin_distance"});
    return {};
}

Status Predictor::set_input(const PredictorInput& input) {
    std::vector<Put> puts;
    SPLAT_TRY(add_images(input.images, puts));
    puts.push_back({view_to_world_, {}, input.view_to_world, "view_to_world"});
    puts.push_back({quaternion_, {}, input.quaternions, "quaternions"});
    if (focal_ != kNoValue) puts.push_back({focal_, {}, input.focals, "focals"});
    if (tokens_ != kNoValue) puts.push_back({tokens_, {}, input.tokens, "tokens"});
    if (config_.embedding == Embedding::kPose)
        puts.push_back({embedding_, pose_scalars(input.view_to_world), {}, "embedding"});
    if (config_.embedding == Embedding::kIndex)
        puts.push_back({embedding_, index_scalars(config_, images()), {}, "embedding"});
    if (config_.embedding == Embedding::kCustom)
        puts.push_back({embedding_,
                        exchange_halves(input.embedding, config_.embedding_length()),
                        {},
                        "embedding"});
    for (Put& put : puts) {
        if (!put.owned.empty()) put.values = put.owned;
        SPLAT_TRY(check_put(put));
    }
    input_changed_ = true;
    for (const Put& put : puts) SPLAT_TRY(write_put(put));
    if (counter_ == kNoValue) return {};
    const std::uint32_t counter[4] = {static_cast<std::uint32_t>(input.seed),
                                      static_cast<std::uint32_t>(input.seed >> 32), input.step, 0};
    return context_.write(executor_->tensor(counter_), counter, sizeof counter);
}

Status Predictor::backward() {
    if (input_changed_)
        return error(Code::kInvalidState,
                     "backward was called after new inputs without their forward pass");
    return executor_->backward();
}

namespace {

Predictor::Outputs five(const std::vector<ValueId>& ids,
                        const vk::BufferView& (nn::Executor::*view)(ValueId) const,
                        const nn::Executor& executor) {
    const auto get = [&](std::size_t i) { return (executor.*view)(ids[i]); };
    return {get(0), get(1), get(2), get(3), get(4)};
}

}  // namespace

Predictor::Outputs Predictor::outputs() const {
    return five(outputs_, &nn::Executor::tensor, *executor_);
}

Predictor::Outputs Predictor::output_gradients() const {
    return five(outputs_, &nn::Executor::gradient, *executor_);
}

Result<std::vector<float>> Predictor::input_gradient(Input input) const {
    const bool there =
        options_.gradients && options_.input_gradient &&
        (input == Input::kImages || (input == Input::kTokens && config_.tokens > 0) ||
         (input == Input::kEmbedding && config_.embedding == Embedding::kCustom));
    if (!there)
        return error(Code::kInvalidState,
                     "predictor: no gradient of the %s is computed: the model was made without "
                     "SPLAT_MODEL_INPUT_GRADIENTS, or its configuration does not have them",
                     input == Input::kImages   ? "images"
                     : input == Input::kTokens ? "tokens"
                                               : "custom embedding");
    const vk::BufferView& view = executor_->gradient(input == Input::kImages   ? image_
                                                     : input == Input::kTokens ? tokens_
                                                                               : embedding_);
    std::vector<float> values(view.shape.elements());
    SPLAT_TRY(context_.read(view, values.data(), values.size() * sizeof(float)));
    if (input != Input::kEmbedding) return values;
    return exchange_halves(values, config_.embedding_length());
}

}  // namespace splat::model
