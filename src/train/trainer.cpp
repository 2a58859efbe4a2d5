#include "train/trainer.h"

#include "core/finite.h"
#include "core/stopwatch.h"

namespace splat::train {
namespace {

/// Copy a set, or its gradients, to another of the same size.
Result<vk::CommandList> copy_of(vk::Context& context, const gaussians::SetViews& from,
                                const gaussians::SetViews& to) {
    vk::Recorder recorder(context);
    SPLAT_TRY(recorder.copy(from.gaussians, to.gaussians));
    SPLAT_TRY(recorder.copy(from.colors, to.colors));
    return recorder.finish();
}

template <class T>
std::span<const T> part_of(std::span<const T> all, std::size_t count, std::size_t first,
                           std::size_t number) {
    if (all.empty()) return {};
    const std::size_t each = all.size() / count;
    return all.subspan(first * each, number * each);
}

}  // namespace

Result<std::unique_ptr<Trainer>> Trainer::create(vk::Context& context,
                                                 const model::ModelConfig& network,
                                                 const config::TrainConfig& config) {
    if (config.schedule == config::Schedule::kStep && config.step_lr_at == 0)
        return invalid("'opt.step_lr_at' is 0, expected at least 1 where opt.lr_schedule is step");
    std::unique_ptr<Trainer> self(new Trainer(context, config));
    SPLAT_TRY(self->build(network));
    return self;
}

Status Trainer::build(const model::ModelConfig& network) {
    model::ModelOptions options;
    options.objects = config_.micro_batch;
    options.gradients = true;
    options.recompute = config_.recompute;
    options.build.training = true;
    options.build.precision = config_.precision;
    SPLAT_ASSIGN(model_, model::Model::create(context_, network, options));
    OptimiserDesc adam;
    adam.rules = {{1, config_.betas, config_.eps}};
    adam.schedule = config_;
    if (config_.ema)
        adam.ema = ops::EmaSchedule{config_.ema_every, config_.ema_after, config_.ema_most};
    SPLAT_TRY(add_parameters(adam, model_->parameters()));
    SPLAT_ASSIGN(Optimiser optimiser, Optimiser::create(context_, std::move(adam)));
    optimiser_ = std::make_unique<Optimiser>(std::move(optimiser));

    raster::RasterDesc desc;
    desc.gaussians = network.gaussians();
    desc.views = config_.targets;
    desc.width = desc.height = network.resolution;
    desc.sh_degree = network.sh_degree;
    desc.backward = true;
    SPLAT_ASSIGN(rasterizer_, raster::Rasterizer::create(context_, desc));
    SPLAT_ASSIGN(grad_image_,
                 context_.memory().allocate(desc.pixels() * 16, vk::MemoryKind::kDevice,
                                            "gradient of rendered images"));
    SPLAT_ASSIGN(grad_depth_,
                 context_.memory().allocate(16, vk::MemoryKind::kDevice, "gradient of the depth"));
    SPLAT_TRY(context_.fill(grad_depth_.range(), 0));

    RenderLossDesc loss;
    loss.views = desc.views;
    loss.height = loss.width = network.resolution;
    loss.image = rasterizer_->workspace().image.range();
    loss.grad_image = grad_image_.range();
    loss.config = config_;
    loss.pixel_weights = config_.edge_weight > 0 && config_.edge_by_size;
    if (loss.pixel_weights) SPLAT_SET(sizes_, SizeMap::create(context_, desc));
    std::vector<io::WeightsFile> files;
    std::vector<const io::NamedTensors*> lpips;
    if (config_.lpips_weight > 0) {
        if (config_.lpips_weights.empty())
            return invalid(
                "'opt.lambda_lpips' is %g, but 'opt.lpips_weights' names no files; give "
                "those of torchvision's vgg16 and of the lpips package, or set "
                "'opt.lambda_lpips' to 0",
                config_.lpips_weight);
        for (const std::string& path : config_.lpips_weights) {
            SPLAT_ASSIGN(io::WeightsFile file, io::load_weights(path));
            files.push_back(std::move(file));
        }
        for (const io::WeightsFile& file : files) lpips.push_back(&file.tensors);
        loss.lpips = lpips;
    }
    SPLAT_ASSIGN(RenderLoss made, RenderLoss::create(context_, loss));
    loss_ = std::make_unique<RenderLoss>(std::move(made));

    if (config_.micro_batch == 1) return {};
    // The rasterizer's lists name one set, and recording them costs more than copying.
    SPLAT_ASSIGN(scene_, gaussians::allocate_set(context_, desc));
    SPLAT_ASSIGN(grad_scene_, gaussians::allocate_set(context_, desc));
    for (std::uint32_t i = 0; i < config_.micro_batch; ++i) {
        SPLAT_ASSIGN(vk::CommandList in, copy_of(context_, model_->set(i), scene_.views()));
        SPLAT_ASSIGN(vk::CommandList out,
                     copy_of(context_, grad_scene_.views(), model_->set(i, true)));
        copy_in_.push_back(std::move(in));
        copy_out_.push_back(std::move(out));
    }
    return {};
}

Status Trainer::check(const TrainBatch& batch) const {
    const model::ModelConfig& c = model_->config();
    const std::size_t pixels = std::size_t{c.resolution} * c.resolution;
    const std::size_t objects = config_.batch_size;
    const std::size_t inputs = objects * c.views;
    const std::size_t targets = objects * config_.targets;
    const auto expect = [](const char* name, std::size_t got, std::size_t expected) -> Status {
        if (got == expected) return {};
        return error(Code::kShape, "training batch: %s has %zu numbers, expected %zu", name, got,
                     expected);
    };
    SPLAT_TRY(expect("images", batch.images.size(), inputs * c.input_channels() * pixels));
    SPLAT_TRY(expect("view_to_world", batch.view_to_world.size(), inputs * 16));
    SPLAT_TRY(expect("quaternions", batch.quaternions.size(), inputs * 4));
    SPLAT_TRY(expect("targets", batch.targets.size(), targets * 3 * pixels));
    if (batch.cameras.size() != targets)
        return error(Code::kShape, "training batch: %zu cameras, expected %zu",
                     batch.cameras.size(), targets);
    if (const std::size_t bad = find_not_finite(batch.targets); bad < batch.targets.size())
        return invalid("training batch: targets hold %g at %zu, expected finite numbers",
                       static_cast<double>(batch.targets[bad]), bad);
    return {};
}

Status Trainer::step(const TrainBatch& batch, TrainStep& result) {
    SPLAT_TRY(check(batch));
    result = {};
    SPLAT_TRY(model_->parameters().zero_gradients());
    ScaleTerms terms;
    for (std::uint32_t first = 0; first < config_.batch_size; first += config_.micro_batch)
        SPLAT_TRY(pass(batch, first, terms, result));
    Stopwatch watch;
    for (const std::uint32_t first : terms.waiting)
        SPLAT_TRY(repeat_for_scales(batch, first, terms.outliers));
    result.loss.total += terms.outliers.loss();
    result.network_seconds += watch.lap();
    OptimiserStep update;
    SPLAT_TRY(optimiser_->step(update, result.loss.total));
    result.gradients_zero = update.gradients.zero;
    result.skipped = update.was_skipped;
    result.rate = update.rate;
    result.update_seconds += watch.lap();
    result.step = steps_ = update.step;
    ++attempts_;
    const std::lock_guard lock(last_mutex_);
    last_ = result;
    return {};
}

Status Trainer::forward(const TrainBatch& batch, std::uint32_t first) {
    const std::uint32_t all = config_.batch_size;
    const std::uint32_t objects = config_.micro_batch;
    model::ModelInput input;
    input.images = part_of(batch.images, all, first, objects);
    input.view_to_world = part_of(batch.view_to_world, all, first, objects);
    input.quaternions = part_of(batch.quaternions, all, first, objects);
    input.focals = part_of(batch.focals, all, first, objects);
    input.embedding = part_of(batch.embedding, all, first, objects);
    input.tokens = part_of(batch.tokens, all, first, objects);
    input.seed = config_.seed;
    // A distinct number for each pass; dropout depends on it.
    input.step = static_cast<std::uint32_t>(attempts_ * (all / objects) + first / objects);
    SPLAT_TRY(model_->set_input(input));
    return model_->forward();
}

Status Trainer::pass(const TrainBatch& batch, std::uint32_t first, ScaleTerms& terms,
                     TrainStep& result) {
    Stopwatch watch;
    SPLAT_TRY(forward(batch, first));
    result.non_finite += model_->ledger().non_finite();
    result.network_seconds += watch.lap();
    for (std::uint32_t i = 0; i < config_.micro_batch; ++i)
        SPLAT_TRY(render(batch, first + i, i, result));
    if (config_.scale_terms) SPLAT_TRY(take_scales(first, terms));
    result.render_seconds += watch.lap();
    SPLAT_TRY(model_->backward(true));
    result.network_seconds += watch.lap();
    return {};
}

Status Trainer::render(const TrainBatch& batch, std::uint32_t object, std::uint32_t slot,
                       TrainStep& result) {
    const std::array<float, 3> background =
        config_.white_background ? std::array<float, 3>{1, 1, 1} : std::array<float, 3>{};
    SPLAT_ASSIGN(
        const raster::PackedViews views,
        raster::pack_views(rasterizer_->desc(),
                           part_of(batch.cameras, config_.batch_size, object, 1), background));
    const bool copied = config_.micro_batch > 1;
    if (copied) SPLAT_TRY(context_.run(copy_in_[slot]));
    const gaussians::SetViews scene = copied ? scene_.views() : model_->set(slot);
    SPLAT_TRY(rasterizer_->forward(scene, views));
    if (sizes_)
        SPLAT_TRY(sizes_->draw(scene, part_of(batch.cameras, config_.batch_size, object, 1),
                               loss_->pixel_weights()));
    SPLAT_TRY(loss_->set_targets(part_of(batch.targets, config_.batch_size, object, 1)));
    LossTerms terms;
    const float weight = 1 / static_cast<float>(config_.batch_size);
    const double lpips = steps() >= config_.lpips_after ? config_.lpips_weight : 0;
    SPLAT_TRY(loss_->run(weight, lpips, terms));
    SPLAT_TRY(rasterizer_->backward(grad_image_.range(), grad_depth_.range(),
                                    copied ? grad_scene_.views() : model_->set(slot, true)));
    if (copied) SPLAT_TRY(context_.run(copy_out_[slot]));
    result.loss.add(terms, static_cast<double>(weight));
    const raster::RasterDesc& desc = rasterizer_->desc();
    const raster::RasterStats& stats = rasterizer_->stats();
    result.pairs += stats.pairs;
    result.visible += stats.visible;
    result.culled += std::uint64_t{desc.gaussians} * desc.views - stats.visible;
    return {};
}

Result<io::NamedTensors> Trainer::averaged_state() {
    SPLAT_ASSIGN(const io::NamedTensors current, model::save_state(*model_));
    io::NamedTensors state;
    for (const io::NamedTensor& tensor : current) {
        io::NamedTensor copy = tensor;
        for (const OptimiserParameter& parameter : optimiser_->parameters())
            if (parameter.name == tensor.name)
                SPLAT_TRY(optimiser_->read_average(parameter, copy.values.own()));
        SPLAT_TRY(state.add(std::move(copy)));
    }
    return state;
}

}  // namespace splat::train
