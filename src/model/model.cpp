#include "model/model.h"

#include <algorithm>
#include <cstring>

#include "core/checked_math.h"
#include "core/finite.h"
#include "core/log.h"
#include "model/camera_embedding.h"
#include "model/lgm_unet.h"
#include "ops/gaussian_head.h"
#include "ops/gaussian_rows.h"

namespace splat::model {
namespace {

using nn::kNoValue;
using nn::ValueId;
using ops::Layout;

/// Distance of the dropout counters of two slices: more than a network has layers.
constexpr std::uint32_t kDropoutStreams = 1U << 16;

Status expect_count(const char* name, std::size_t got, std::size_t expected) {
    if (got == expected) return {};
    return error(Code::kShape, "model: '%s' has %zu numbers, expected %zu", name, got, expected);
}

Status expect_finite(const char* name, std::span<const float> values) {
    const std::size_t bad = find_not_finite(values);
    if (bad == values.size()) return {};
    return invalid("model: '%s' holds %g at %zu, expected finite numbers", name,
                   static_cast<double>(values[bad]), bad);
}

/// Copies of the vectors of `from` into `to` with the first `head` numbers moved behind the others.
Result<vk::CommandList> exchange_list(vk::Context& context, const vk::BufferView& from,
                                      const vk::BufferView& to, std::uint32_t head) {
    const std::uint64_t row = std::uint64_t{from.shape[1]} * sizeof(float);
    const std::uint64_t first = std::uint64_t{head} * sizeof(float);
    vk::Recorder recorder(context);
    for (std::uint64_t at = 0; at < row * from.shape[0]; at += row) {
        SPLAT_TRY(recorder.copy(from.part(at, first), to.part(at + row - first, first)));
        SPLAT_TRY(recorder.copy(from.part(at + first, row - first), to.part(at, row - first)));
    }
    return recorder.finish();
}

/// Larger weights would take up to four times their memory once more.
bool keeps_prepared(const ModelOptions& options, const nn::Graph::Bytes& bytes) {
    constexpr std::uint64_t kMostKeptWeights = std::uint64_t{1} << 30;
    return options.keep_prepared && bytes.parameters <= kMostKeptWeights;
}

/// Before any of it is allocated.
void tell_memory(const nn::Graph& graph, const ModelOptions& options) {
    const nn::Graph::Bytes bytes = graph.forward_bytes();
    std::uint64_t weights = 0;
    for (const nn::Value& value : graph.values())
        if (value.kind == nn::ValueKind::kParameter && value.base == kNoValue)
            weights += value.shape.elements();
    const auto mib = [](std::uint64_t count) { return static_cast<double>(count) / (1 << 20); };
    std::string kept;
    if (keeps_prepared(options, bytes) && !options.gradients)  // which change what is prepared
        kept = format(", the second and later ones about %.0f MiB besides", mib(bytes.prepared));
    log(LogLevel::kInfo,
        format("the network has %llu weights, %.0f MiB on the device; a forward pass of one object "
               "takes about %.0f MiB more%s",
               llu(weights), mib(bytes.parameters), mib(bytes.pass), kept.c_str()));
}

}  // namespace

Result<std::unique_ptr<Model>> Model::create(vk::Context& context, const ModelConfig& config,
                                             const ModelOptions& options) {
    SPLAT_TRY(check(config));
    std::unique_ptr<Model> made(new Model(context, config, options, 1));
    SPLAT_TRY(made->build());
    tell_memory(made->graph_, options);
    for (std::uint32_t slice = made->objects_that_fit();; --slice) {
        if (options.objects % slice != 0) continue;
        if (made->slice_ != slice) {
            made.reset(new Model(context, config, options, slice));
            SPLAT_TRY(made->build());
        }
        const Status planned = made->plan();
        if (planned.ok()) break;
        // Operators' own memory may exceed a binding where values do not.
        if (planned.code() != Code::kUnsupported || slice == 1) return planned;
    }
    SPLAT_TRY(made->set_rays(pixel_rays(config)));
    for (const auto& [id, values] : made->constants_)
        SPLAT_TRY(context.write(made->executor_->tensor(id), values.data(),
                                values.size() * sizeof(float)));
    const gaussians::SetViews all = made->sets(false);
    SPLAT_ASSIGN(OutputLedger counts,
                 OutputLedger::create(context, made->raw_output(), made->set_desc_, all));
    made->counts_ = std::make_unique<OutputLedger>(std::move(counts));
    if (options.gradients) {
        const gaussians::SetViews g = made->sets(true);
        SPLAT_TRY(context.fill(g.gaussians, 0));
        SPLAT_TRY(context.fill(g.colors, 0));
    }
    return made;
}

Result<std::vector<nn::Parameter>> Model::parameters_of(vk::Context& context,
                                                        const ModelConfig& config) {
    SPLAT_TRY(check(config));
    Model model(context, config, {}, 1);
    SPLAT_TRY(model.build());
    std::vector<nn::Parameter> parameters;
    for (const nn::Value& value : model.graph_.values())
        if (value.kind == nn::ValueKind::kParameter && value.base == kNoValue)
            parameters.push_back({value.name, value.shape, value.trainable, {}, {}});
    return parameters;
}

/// The largest divisor of the batch that fits, at least 1, judged by the graph of one object.
std::uint32_t Model::objects_that_fit() const {
    const vk::DeviceLimits& limits = context_.device().info().limits;
    std::uint64_t most = limits.max_storage_buffer_bytes;
    if (context_.device().kernels() == vk::Kernels::kCpu)
        most = std::min(most, limits.max_texel_elements * 16);
    if (options_.most_bytes != 0) most = options_.most_bytes;
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
Status Model::plan() {
    SPLAT_ASSIGN(nn::Parameters parameters,
                 nn::Parameters::create(context_, graph_, options_.gradients));
    parameters_ = std::make_unique<nn::Parameters>(std::move(parameters));
    nn::ExecutorDesc desc;
    desc.outputs = outputs_;
    desc.outputs.push_back(raw_);
    desc.keep_prepared = keeps_prepared(options_, graph_.forward_bytes());
    desc.recompute = options_.recompute;
    desc.backward_parts = options_.backward_parts;
    desc.backward = options_.gradients;
    if (options_.gradients) {
        desc.grad_outputs = outputs_;
        if (options_.input_gradient) desc.grad_inputs.push_back(image_);
        if (options_.input_gradient && config_.embedding == Embedding::kCustom)
            desc.grad_inputs.push_back(embedding_);
        if (options_.input_gradient && config_.tokens > 0) desc.grad_inputs.push_back(tokens_);
    }
    SPLAT_ASSIGN(executor_, nn::Executor::create(context_, graph_, *parameters_, desc));
    if (slices() > 1) {
        const std::vector<ValueId> inputs = sliced_inputs();
        SPLAT_ASSIGN(sliced_,
                     ObjectSlices::create(
                         context_, *executor_,
                         {inputs, desc.outputs, desc.grad_outputs, desc.grad_inputs}, slices()));
    }
    return config_.embedding == Embedding::kCustom ? record_exchange() : Status();
}

/// All inputs of the graph except the rays, which are the same for each slice.
std::vector<ValueId> Model::sliced_inputs() const {
    std::vector<ValueId> inputs;
    for (const ValueId id :
         {image_, view_to_world_, quaternion_, focal_, origin_, embedding_, tokens_, counter_})
        if (id != kNoValue) inputs.push_back(id);
    return inputs;
}

Status Model::record_exchange() {
    const auto make = [&](const Shape& shape, vk::Buffer& buffer, vk::BufferView& view) -> Status {
        SPLAT_ASSIGN(buffer, context_.memory().allocate(shape.elements() * sizeof(float),
                                                        vk::MemoryKind::kDevice, "embedding"));
        view = buffer.view(shape);
        return {};
    };
    const std::uint32_t length = config_.embedding_length();
    const vk::BufferView inside = tensor(embedding_);
    SPLAT_TRY(make(inside.shape, exchanged_, exchanged_view_));
    SPLAT_ASSIGN(exchange_, exchange_list(context_, exchanged_view_, inside, length / 2));
    if (!options_.gradients || !options_.input_gradient) return {};
    SPLAT_TRY(make(inside.shape, exchanged_gradient_, exchanged_gradient_view_));
    SPLAT_ASSIGN(exchange_gradient_, exchange_list(context_, gradient(embedding_),
                                                   exchanged_gradient_view_, length - length / 2));
    return {};
}

Status Model::build() {
    set_desc_ = {config_.gaussians(), config_.sh_degree};
    const std::uint32_t r = config_.resolution;
    const std::uint32_t end = config_.output_resolution();
    const std::uint32_t n = slice_ * config_.views;
    image_ = graph_.input("images", {n, config_.image_channels(), r, r});
    rays_value_ = graph_.input("rays", {3, end, end}, Layout::kRowMajor);
    view_to_world_ = graph_.input("view_to_world", {n, 4, 4}, Layout::kRowMajor);
    quaternion_ = graph_.input("quaternions", {n, 4}, Layout::kRowMajor);
    if (config_.fov_degrees == 0) focal_ = graph_.input("focals", {n, 2}, Layout::kRowMajor);
    if (config_.origin_distance) origin_ = graph_.input("origin_distance", {n}, Layout::kRowMajor);
    if (config_.positions == kHeadInputDepth)
        origin_ = graph_.input("depths", {n, end, end}, Layout::kRowMajor);
    const ValueId embedding = build_embedding();
    if (config_.tokens > 0)
        tokens_ = graph_.input("tokens", {n, config_.token_dim, config_.tokens, 1});
    const bool lgm = config_.network == config::Network::kLgmUnet;  // has no dropout
    const bool random =
        !lgm && options_.build.training && (config_.dropout > 0 || config_.lora.dropout > 0);
    if (random) counter_ = graph_.input("random_counter", {4}, Layout::kRowMajor);

    ValueId channels = kNoValue;
    if (lgm) {
        LgmUnet unet(graph_, config_, options_.build);
        raw_ = unet.build(image_);
        channels = unet.turned(raw_);
        inits_ = unet.inits();
        constants_ = unet.constants();
    } else {
        SongUnet unet(graph_, config_, options_.build);
        raw_ = channels = unet.build(image_, embedding, tokens_, counter_);
        inits_ = unet.inits();
    }
    outputs_ = graph_.node(ops::gaussian_set_row(),
                           {channels, rays_value_, view_to_world_, quaternion_, focal_, origin_},
                           ops::gaussian_head_attributes(config_.head(), config_.views));
    SPLAT_TRY(graph_.status());
    const auto& values = graph_.values();
    if (!options_.gradients ||
        std::ranges::any_of(values, [](const nn::Value& v) { return v.trainable; }))
        return {};
    return invalid(
        "configuration: %s leave no parameter to be trained, but gradients are requested",
        config_.lora.rank == 0 ? "the names of opt.freeze"
                               : "opt.lora_targets, opt.train_with_adapters and opt.freeze");
}

/// The vector that modulates blocks, with its halves exchanged as the published network takes it.
ValueId Model::build_embedding() {
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

Status Model::init(std::uint64_t seed) {
    for (const nn::Parameter& parameter : parameters_->all())
        SPLAT_TRY(
            parameters_->write(parameter, initial_values(config_, inits_.at(parameter.name),
                                                         parameter.name, parameter.shape, seed)));
    return {};
}

Status Model::check_values(const InputValues& input) const {
    SPLAT_TRY(
        expect_count(input.name, input.values.size(), this->input(input.id).shape.elements()));
    return expect_finite(input.name, input.values);
}

Status Model::write_input(nn::ValueId id, std::span<const std::byte> bytes) {
    return context_.write(input(id), bytes.data(), bytes.size());
}

Status Model::set_rays(std::vector<float> rays) {
    const InputValues input{rays_value_, {}, rays, "ray_dirs"};
    SPLAT_TRY(check_values(input));
    input_changed_ = true;
    SPLAT_TRY(write_input(input.id, std::as_bytes(input.values)));
    rays_ = std::move(rays);
    return {};
}

/// The planes that the network sees, and the last plane of each image: its depths, or the origin distance.
Status Model::add_images(std::span<const float> all, std::vector<InputValues>& inputs) const {
    const std::size_t pixels = std::size_t{config_.resolution} * config_.resolution;
    const std::size_t seen = config_.image_channels() * pixels;
    const std::size_t given = config_.input_channels() * pixels;
    SPLAT_TRY(expect_count("images", all.size(), images() * given));
    const bool depths = config_.positions == kHeadInputDepth;
    if (!config_.origin_distance && !depths) {
        inputs.push_back({image_, {}, all, "images"});
        return {};
    }
    std::vector<float> shown;
    std::vector<float> distances;
    for (std::size_t image = 0; image < images(); ++image) {
        const auto planes = all.subspan(image * given, given);
        const auto last = planes.subspan(seen);
        if (depths) {
            distances.insert(distances.end(), last.begin(), last.end());
        } else if (std::ranges::any_of(last, [&](float d) { return d != last[0]; })) {
            return invalid(
                "model: the origin distance of image %zu varies, expected one number "
                "in the whole plane",
                image);
        } else {
            distances.push_back(last[0]);
        }
        shown.insert(shown.end(), planes.begin(),
                     planes.begin() + static_cast<std::ptrdiff_t>(seen));
    }
    inputs.push_back({image_, std::move(shown), {}, "images"});
    inputs.push_back({origin_, std::move(distances), {}, depths ? "depths" : "origin_distance"});
    return {};
}

Status Model::set_input(const ModelInput& input) {
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
        inputs.push_back({embedding_, {}, input.embedding, "embedding"});
    for (InputValues& each : inputs) {
        if (!each.owned.empty()) each.values = each.owned;
        SPLAT_TRY(check_values(each));
    }
    input_changed_ = true;
    vk::BatchScope scope(context_, batch_);
    for (const InputValues& each : inputs)
        SPLAT_TRY(write_input(each.id, std::as_bytes(each.values)));
    input_given_ = true;
    SPLAT_TRY(write_counters(input.seed, input.step));
    return scope.finish();
}

Status Model::write_counters(std::uint64_t seed, std::uint32_t step) {
    if (counter_ == kNoValue) return {};
    std::vector<std::uint32_t> counters;
    for (std::uint32_t slice = 0; slice < slices(); ++slice)
        counters.insert(counters.end(),
                        {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                         step, slice * kDropoutStreams});
    return write_input(counter_, std::as_bytes(std::span(counters)));
}

Status Model::forward() {
    vk::BatchScope scope(context_, batch_);
    SPLAT_TRY(forward_unread());
    const vk::BufferView& counts = counts_->counts();
    SPLAT_TRY(context_.read_later(counts, counts.bytes, [this](std::span<const std::byte> bytes) {
        std::vector<std::uint32_t> words(bytes.size() / sizeof(std::uint32_t));
        std::memcpy(words.data(), bytes.data(), bytes.size());
        counts_->take(words);
    }));
    return scope.finish();
}

Status Model::forward_unread() {
    SPLAT_TRY(check_unmapped());
    input_changed_ = false;
    outside_writes_ = outside_->writes;
    vk::BatchScope scope(context_, batch_);
    if (!exchange_.empty()) SPLAT_TRY(context_.run(exchange_));
    version_ = gaussians::next_version();  // a pass that fails may have written a part
    SPLAT_TRY(sliced_ == nullptr ? executor_->forward() : sliced_->forward());
    if (rows_ != nullptr) SPLAT_TRY(context_.run(rows_->unpack));
    SPLAT_TRY(counts_->measure());
    return scope.finish();
}

Status Model::backward(bool of_sets, const nn::BetweenParts& between) {
    SPLAT_TRY(check_unmapped());
    if (input_changed_ || outside_writes_ != outside_->writes)
        return bad_state("backward was called after new inputs without their forward pass");
    vk::BatchScope scope(context_, batch_);
    if (gradient_rows_ != nullptr)
        SPLAT_TRY(context_.run(of_sets ? gradient_rows_->unpack : gradient_rows_->pack));
    SPLAT_TRY(sliced_ == nullptr ? executor_->backward(between) : sliced_->backward(between));
    if (!exchange_gradient_.empty()) SPLAT_TRY(context_.run(exchange_gradient_));
    return scope.finish();
}

gaussians::SetViews Model::sets(bool gradients) const {
    const auto of = [&](std::size_t i) {
        return gradients ? gradient(outputs_[i]) : tensor(outputs_[i]);
    };
    return {of(0), of(1), options_.objects * set_desc_.gaussians, gradients ? 0 : version_,
            set_desc_.sh_degree};
}

gaussians::SetViews Model::set(std::uint32_t object, bool gradients) const {
    const std::uint32_t each = set_desc_.gaussians;
    return gaussians::part(set_desc_, sets(gradients), object * each, each);
}

Result<Model::Outputs> Model::outputs() {
    return rows(rows_, false);
}

Result<Model::Outputs> Model::output_gradients() {
    return rows(gradient_rows_, true);
}

Result<Model::Outputs> Model::rows(std::unique_ptr<Rows>& rows, bool gradients) {
    if (rows != nullptr) return rows->views;
    auto made = std::make_unique<Rows>();
    const gaussians::SetViews set = sets(gradients);
    const std::uint32_t n = options_.objects;
    const std::uint32_t m = set_desc_.gaussians;
    const auto make = [&](std::size_t i, const Shape& shape, vk::BufferView& view) -> Status {
        SPLAT_ASSIGN(made->memory[i],
                     context_.memory().allocate(vk::quad_bytes(shape.elements()),
                                                vk::MemoryKind::kDevice, "results of a model"));
        view = made->memory[i].view(shape);
        return {};
    };
    Outputs& o = made->views;
    SPLAT_TRY(make(0, {n, m, 3}, o.means));
    SPLAT_TRY(make(1, {n, m, 1}, o.opacities));
    SPLAT_TRY(make(2, {n, m, 3}, o.scales));
    SPLAT_TRY(make(3, {n, m, 4}, o.rotations));
    SPLAT_TRY(make(4, {n, m, set_desc_.color_floats() / 3, 3}, o.sh));
    gaussians::SetDesc desc = set_desc_;
    desc.gaussians = set.count;
    const ops::GaussianRows all{o.means, o.scales, o.rotations, o.opacities, o.sh};
    vk::Recorder unpack(context_), pack(context_);
    SPLAT_TRY(ops::unpack_rows(unpack, desc, set, all, false));
    SPLAT_ASSIGN(made->unpack, unpack.finish());
    SPLAT_TRY(ops::pack_rows(pack, desc, all, set));
    SPLAT_ASSIGN(made->pack, pack.finish());
    SPLAT_TRY(context_.run(made->unpack));
    rows = std::move(made);
    return rows->views;
}

}  // namespace splat::model
