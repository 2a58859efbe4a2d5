#include "model/predictor.h"

#include <algorithm>

#include "core/checked_math.h"
#include "core/finite.h"

namespace splat::model {
namespace {

using nn::kNoValue;
using nn::ValueId;
using ops::Layout;

/// Distance of the dropout counters of two slices: more than a network has layers.
constexpr std::uint32_t kDropoutStreams = 1U << 16;

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

/// The published network takes each vector with its halves exchanged.
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
    std::unique_ptr<Predictor> made(new Predictor(context, config, options, 1));
    SPLAT_TRY(made->build());
    for (std::uint32_t slice = made->objects_that_fit();; --slice) {
        if (options.objects % slice != 0) continue;
        if (made->slice_ != slice) {
            made.reset(new Predictor(context, config, options, slice));
            SPLAT_TRY(made->build());
        }
        const Status planned = made->plan();
        if (planned.ok()) break;
        // Operators' own memory may exceed a binding where values do not.
        if (planned.code() != Code::kUnsupported || slice == 1) return planned;
    }
    SPLAT_TRY(made->set_rays(pixel_rays(config)));
    return made;
}

/// The largest divisor of the batch that fits, at least 1, judged by the graph of one object.
std::uint32_t Predictor::objects_that_fit() const {
    const vk::DeviceLimits& limits = context_.device().info().limits;
    const std::uint64_t most = options_.most_bytes != 0 ? options_.most_bytes
                                                        : std::min(limits.max_storage_buffer_bytes,
                                                                   limits.max_texel_elements * 16);
    std::uint64_t largest = 1;
    for (const nn::Value& value : graph_.values()) {
        if (value.kind == nn::ValueKind::kParameter || value.shape.rank() < 2) continue;
        const std::uint64_t channels = value.shape[1];
        largest = std::max(
            largest, value.shape.elements() / channels * round_up(channels, 4) * sizeof(float));
    }
    std::uint32_t fit = 1;
    for (std::uint32_t count = 1; count <= options_.objects; ++count)
        if (options_.objects % count == 0 && count * largest <= most) fit = count;
    return fit;
}

/// Create the parameters and the executor of the built graph.
Status Predictor::plan() {
    SPLAT_ASSIGN(nn::Parameters parameters,
                 nn::Parameters::create(context_, graph_, options_.gradients));
    parameters_ = std::make_unique<nn::Parameters>(std::move(parameters));
    nn::ExecutorDesc desc;
    desc.outputs = outputs_;
    desc.outputs.push_back(raw_);
    desc.keep_prepared = options_.keep_prepared;
    desc.recompute = options_.recompute;
    desc.backward = options_.gradients;
    if (options_.gradients) {
        desc.grad_outputs = outputs_;
        if (options_.input_gradient) desc.grad_inputs.push_back(image_);
        if (options_.input_gradient && config_.embedding == Embedding::kCustom)
            desc.grad_inputs.push_back(embedding_);
        if (options_.input_gradient && config_.tokens > 0) desc.grad_inputs.push_back(tokens_);
    }
    SPLAT_ASSIGN(executor_, nn::Executor::create(context_, graph_, *parameters_, desc));
    if (slices() == 1) return {};
    SPLAT_ASSIGN(sliced_, ObjectSlices::create(context_, *executor_,
                                               {desc.outputs, desc.grad_outputs, desc.grad_inputs},
                                               slices()));
    return {};
}

Status Predictor::build() {
    const std::uint32_t r = config_.resolution;
    const std::uint32_t n = slice_ * config_.views;
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
                 "configuration: %s leave no parameter to be trained, but gradients are requested",
                 config_.lora.rank == 0
                     ? "the names of opt.freeze"
                     : "opt.lora_targets, opt.train_with_adapters and opt.freeze");
}

/// The vector that modulates blocks, with its halves exchanged as the published network takes it.
ValueId Predictor::build_embedding() {
    if (config_.embedding == Embedding::kNone) return kNoValue;
    const std::uint32_t dimension = config_.embedding_dim;
    const bool custom = config_.embedding == Embedding::kCustom;
    const std::uint32_t length = config_.embedding_length();
    embedding_ =
        graph_.input("embedding", {slice_ * config_.views, custom ? length : length / dimension});
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

Status Predictor::check_values(const InputValues& input) const {
    const std::uint64_t of_slice = executor_->tensor(input.id).shape.elements();
    const std::uint64_t all = input.id == rays_value_ ? of_slice : slices() * of_slice;
    SPLAT_TRY(expect_count(input.name, input.values.size(), all));
    return expect_finite(input.name, input.values);
}

/// `bytes` of all slices; rays are the same for each.
Status Predictor::write_input(nn::ValueId id, std::span<const std::byte> bytes) {
    if (sliced_ == nullptr || id == rays_value_)
        return context_.write(executor_->tensor(id), bytes.data(), bytes.size());
    sliced_->hold(id, bytes);
    return {};
}

Status Predictor::set_rays(std::vector<float> rays) {
    const InputValues input{rays_value_, {}, rays, "ray_dirs"};
    SPLAT_TRY(check_values(input));
    input_changed_ = true;
    SPLAT_TRY(write_input(input.id, std::as_bytes(input.values)));
    rays_ = std::move(rays);
    return {};
}

/// The planes that the network sees, and the origin distance, which is the last plane of each image.
Status Predictor::add_images(std::span<const float> all, std::vector<InputValues>& inputs) const {
    const std::size_t pixels = std::size_t{config_.resolution} * config_.resolution;
    const std::size_t seen = config_.image_channels() * pixels;
    const std::size_t given = config_.input_channels() * pixels;
    SPLAT_TRY(expect_count("images", all.size(), images() * given));
    if (!config_.origin_distance) {
        inputs.push_back({image_, {}, all, "images"});
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
    inputs.push_back({image_, std::move(shown), {}, "images"});
    inputs.push_back({origin_, std::move(distances), {}, "origin_distance"});
    return {};
}

Status Predictor::set_input(const PredictorInput& input) {
    std::vector<InputValues> inputs;
    SPLAT_TRY(add_images(input.images, inputs));
    inputs.push_back({view_to_world_, {}, input.view_to_world, "view_to_world"});
    inputs.push_back({quaternion_, {}, input.quaternions, "quaternions"});
    if (focal_ != kNoValue) inputs.push_back({focal_, {}, input.focals, "focals"});
    if (tokens_ != kNoValue) inputs.push_back({tokens_, {}, input.tokens, "tokens"});
    if (config_.embedding == Embedding::kPose)
        inputs.push_back({embedding_, pose_scalars(input.view_to_world), {}, "embedding"});
    if (config_.embedding == Embedding::kIndex)
        inputs.push_back({embedding_, index_scalars(config_, images()), {}, "embedding"});
    if (config_.embedding == Embedding::kCustom)
        inputs.push_back({embedding_,
                          exchange_halves(input.embedding, config_.embedding_length()),
                          {},
                          "embedding"});
    for (InputValues& each : inputs) {
        if (!each.owned.empty()) each.values = each.owned;
        SPLAT_TRY(check_values(each));
    }
    std::vector<std::uint32_t> counters;
    for (std::uint32_t slice = 0; slice < slices(); ++slice)
        counters.insert(counters.end(), {static_cast<std::uint32_t>(input.seed),
                                         static_cast<std::uint32_t>(input.seed >> 32), input.step,
                                         slice * kDropoutStreams});
    input_changed_ = true;
    for (const InputValues& each : inputs)
        SPLAT_TRY(write_input(each.id, std::as_bytes(each.values)));
    if (counter_ == kNoValue) return {};
    return write_input(counter_, std::as_bytes(std::span(counters)));
}

Status Predictor::forward() {
    input_changed_ = false;
    return sliced_ == nullptr ? executor_->forward() : sliced_->forward();
}

Status Predictor::backward() {
    if (input_changed_)
        return error(Code::kInvalidState,
                     "backward was called after new inputs without their forward pass");
    return sliced_ == nullptr ? executor_->backward() : sliced_->backward();
}

Predictor::Outputs Predictor::outputs() const {
    const auto of = [&](std::size_t i) { return tensor(outputs_[i]); };
    return {of(0), of(1), of(2), of(3), of(4)};
}

Predictor::Outputs Predictor::output_gradients() const {
    const auto of = [&](std::size_t i) { return gradient(outputs_[i]); };
    return {of(0), of(1), of(2), of(3), of(4)};
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
    const ValueId id = input == Input::kImages   ? image_
                       : input == Input::kTokens ? tokens_
                                                 : embedding_;
    std::vector<float> values;
    if (sliced_ != nullptr) {
        values = sliced_->input_gradient(id);
    } else {
        const vk::BufferView& view = executor_->gradient(id);
        values.resize(view.shape.elements());
        SPLAT_TRY(context_.read(view, values.data(), values.size() * sizeof(float)));
    }
    if (input != Input::kEmbedding) return values;
    return exchange_halves(values, config_.embedding_length());
}

}  // namespace splat::model
