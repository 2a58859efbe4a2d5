#include "train/trainer.h"

#include <algorithm>
#include <cstring>

#include "core/finite.h"

namespace splat::train {
namespace {

constexpr std::uint32_t kLeastRows = 16, kMostRows = 256;  ///< steps that may be unread
/// Joined lists that are kept. Each holds the network, so that more of them would take too much memory.
constexpr std::size_t kLeastLists = 32, kMostLists = 512;
/// Parts of a backward pass behind which ranks exchange gradients: more hide more, but the device waits after each.
constexpr std::uint32_t kBackwardParts = 8;

Result<vk::CommandList> copy_of(vk::Context& context, const vk::BufferView& from,
                                const vk::BufferView& to) {
    vk::Recorder recorder(context);
    SPLAT_TRY(recorder.copy(from, to));
    return recorder.finish();
}

/// Pairs that arrays of a call must be able to hold for each item: then few scenes make it several passes.
constexpr std::uint64_t kRoomPerItem = 16;

raster::RasterDesc call_of(const raster::RasterDesc& object, std::uint32_t objects) {
    raster::RasterDesc call = object;
    call.gaussians *= objects;
    call.views *= objects;
    call.most_items = object.items() * objects;
    return call;
}

/// A call that draws another set of Gaussians with each object's.
raster::RasterDesc joined_call_of(const raster::RasterDesc& object) {
    raster::RasterDesc call = object;
    call.gaussians *= 2;
    call.most_items = 2 * object.items();
    return call;
}

/// How many objects of a pass one call draws: as many as the device draws in one go, if images of objects begin where
/// bindings can.
std::uint32_t objects_of_a_call(vk::Device& device, const raster::RasterDesc& object,
                                std::uint32_t pass) {
    for (std::uint32_t objects = pass; objects > 1; --objects) {
        const raster::RasterDesc call = call_of(object, objects);
        const std::uint64_t tiles = std::uint64_t{call.tiles_x()} * call.tiles_y() * call.views;
        if (pass % objects == 0 && object.pixels() % 16 == 0 &&
            raster::check_desc(device.info(), call).ok() &&
            tiles <= raster::max_window_tiles(device.info()) &&
            call.items() * kRoomPerItem <= raster::Workspace::max_capacity(device, call))
            return objects;
    }
    return 1;
}

template <class T>
std::span<const T> part_of(std::span<const T> all, std::size_t count, std::size_t first,
                           std::size_t number) {
    if (all.empty()) return {};
    const std::size_t each = all.size() / count;
    return all.subspan(first * each, number * each);
}

}  // namespace

Result<vk::CommandList> copy_of_set(vk::Context& context, const gaussians::SetViews& from,
                                    const gaussians::SetViews& to) {
    vk::Recorder recorder(context);
    SPLAT_TRY(recorder.copy(from.gaussians, to.gaussians));
    SPLAT_TRY(recorder.copy(from.colors, to.colors));
    return recorder.finish();
}

Status Trainer::check_stage(const config::TrainConfig& config, run::Group* group) {
    if (config.schedule == config::Schedule::kStep && config.step_lr_at == 0)
        return invalid("'opt.step_lr_at' is 0, expected at least 1 where opt.lr_schedule is step");
    if (group != nullptr && config.batch_size % (group->count() * config.micro_batch) != 0)
        return invalid(
            "'opt.batch_size' is %u, expected a multiple of ranks times opt.micro_batch, %u x %u",
            config.batch_size, group->count(), config.micro_batch);
    return {};
}

Result<std::unique_ptr<Trainer>> Trainer::create(vk::Context& context,
                                                 const model::ModelConfig& network,
                                                 const config::TrainConfig& config,
                                                 run::Group* group) {
    SPLAT_TRY(check_stage(config, group));
    std::unique_ptr<Trainer> self(new Trainer(context, config, group));
    SPLAT_TRY(self->check_cycle(network));
    SPLAT_TRY(self->build(network));
    return self;
}

std::size_t Trainer::lists_of_a_step() const {
    const std::size_t passes = objects_ / config_.micro_batch;
    std::size_t reads = config_.micro_batch / drawn_;  // in a pass: pairs
    if (sizes_) reads += config_.micro_batch;
    if (config_.scale_terms)
        reads += 2 + 2;  // scales and their gradients; in a pass that is repeated too
    return passes * reads + gradients_->lists() + 2;
}

Status Trainer::build(const model::ModelConfig& network) {
    model::ModelOptions options;
    options.objects = config_.micro_batch;
    options.gradients = true;
    options.recompute = config_.recompute;
    if (group_ != nullptr) options.backward_parts = kBackwardParts;
    options.build.training = true;
    options.build.precision = config_.precision;
    SPLAT_ASSIGN(model_, model::Model::create(context_, network, options));
    return build_stage();
}

/// What depends on batches, losses and targets.
Status Trainer::build_stage() {
    SPLAT_SET(gradients_, GradientSum::create(context_, model_->parameters(), passes(), group_,
                                              config_.scale_terms, model_->executor().parts()));
    raster::RasterDesc desc;  // one object's
    desc.gaussians = model_->config().gaussians();
    desc.views = config_.targets;
    desc.width = desc.height = target_side();
    desc.sh_degree = model_->config().sh_degree;
    desc.backward = true;
    const bool cycle = config_.cycle_every > 0;
    drawn_ = cycle ? 1 : objects_of_a_call(context_.device(), desc, config_.micro_batch);
    raster::RasterDesc call = call_of(desc, drawn_);
    if (cycle) call = joined_call_of(call);
    SPLAT_ASSIGN(rasterizer_, raster::Rasterizer::create(context_, call));
    SPLAT_ASSIGN(grad_image_,
                 context_.memory().allocate(call.pixels() * 16, vk::MemoryKind::kDevice,
                                            "gradient of rendered images"));
    SPLAT_ASSIGN(grad_depth_,
                 context_.memory().allocate(16, vk::MemoryKind::kDevice, "gradient of the depth"));
    SPLAT_TRY(context_.fill(grad_depth_.range(), 0));
    SPLAT_TRY(build_loss(desc));
    SPLAT_TRY(build_planes());
    SPLAT_TRY(build_copies(desc, call));
    SPLAT_TRY(build_optimiser());
    batch_ = vk::Batch(std::clamp(lists_of_a_step(), kLeastLists, kMostLists));
    return {};
}

Status Trainer::build_loss(const raster::RasterDesc& object) {
    RenderLossDesc loss;
    loss.objects = drawn_;
    loss.views = object.views;
    loss.height = loss.width = object.width;
    loss.image = rasterizer_->workspace().image.range();
    loss.grad_image = grad_image_.range();
    loss.config = config_;
    loss.pixel_weights = config_.edge_weight > 0 && config_.edge_by_size;
    if (loss.pixel_weights) SPLAT_SET(sizes_, SizeMap::create(context_, object));
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
    return {};
}

Status Trainer::build_copies(const raster::RasterDesc& object, const raster::RasterDesc& call) {
    if (config_.micro_batch == drawn_ && config_.cycle_every == 0) return {};
    // The rasterizer's lists name one set, and recording them costs more than copying.
    SPLAT_ASSIGN(scene_, gaussians::allocate_set(context_, call));
    SPLAT_ASSIGN(grad_scene_, gaussians::allocate_set(context_, call));
    for (std::uint32_t slot = 0; slot < config_.micro_batch; slot += drawn_) {
        const auto part = [&](bool gradients) {
            return gaussians::part(call, model_->sets(gradients), slot * object.gaussians,
                                   drawn_ * object.gaussians);
        };
        SPLAT_ASSIGN(vk::CommandList in, copy_of_set(context_, part(false), predicted(scene_)));
        SPLAT_ASSIGN(vk::CommandList out,
                     copy_of_set(context_, predicted(grad_scene_), part(true)));
        copy_in_.push_back(std::move(in));
        copy_out_.push_back(std::move(out));
    }
    return build_cycle(object);
}

gaussians::SetViews Trainer::predicted(const gaussians::GaussianSet& set) const {
    return gaussians::part(set.desc, set.views(), 0, drawn_ * model_->set_desc().gaussians);
}

/// Make the optimiser. Notes are the losses of each object of the batch, then the counts of each pass.
Status Trainer::build_optimiser() {
    const vk::BufferView& losses = loss_->losses();
    const vk::BufferView& counts = model_->output_ledger().counts();
    OptimiserDesc adam;
    adam.rules = {{1, config_.betas, config_.eps}};
    adam.schedule = config_;
    if (config_.ema)
        adam.ema = ops::EmaSchedule{config_.ema_every, config_.ema_after, config_.ema_most};
    adam.notes.checked = losses.bytes * config_.batch_size;
    adam.notes.block = losses.bytes;
    adam.notes.unchecked = loss_->unchecked();
    adam.notes.bytes = adam.notes.checked + counts.bytes * passes();
    adam.most_unread = std::clamp(config_.read_every, kLeastRows, kMostRows);
    SPLAT_TRY(add_parameters(adam, model_->parameters()));
    SPLAT_ASSIGN(Optimiser optimiser, Optimiser::create(context_, std::move(adam)));
    optimiser_ = std::make_unique<Optimiser>(std::move(optimiser));
    const auto note = [&](const vk::BufferView& from, std::uint64_t at) {
        return copy_of(context_, from, optimiser_->notes().part(at, from.bytes));
    };
    for (std::uint32_t object = 0; object < objects_; ++object) {
        SPLAT_ASSIGN(vk::CommandList list, note(losses, (first_object() + object) * losses.bytes));
        note_losses_.push_back(std::move(list));
    }
    for (std::uint32_t pass = 0; pass < objects_ / config_.micro_batch; ++pass) {
        SPLAT_ASSIGN(vk::CommandList list, note(counts, config_.batch_size * losses.bytes +
                                                            (first_pass() + pass) * counts.bytes));
        note_counts_.push_back(std::move(list));
    }
    return {};
}

Status Trainer::check(const TrainBatch& batch) const {
    const model::ModelConfig& c = model_->config();
    const std::size_t pixels = std::size_t{c.resolution} * c.resolution;
    const std::size_t objects = objects_;
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
    const bool takes_planes = config_.weighs(&config::TrainConfig::plane_weight);
    SPLAT_TRY(expect("planes", batch.planes.size(),
                     takes_planes ? inputs * data::kPlaneChannels * pixels : 0));
    const std::size_t side = target_side();
    SPLAT_TRY(expect("targets", batch.levels.empty() ? batch.targets.size() : batch.levels.size(),
                     targets * 3 * side * side));
    if (batch.cameras.size() != targets)
        return error(Code::kShape, "training batch: %zu cameras, expected %zu",
                     batch.cameras.size(), targets);
    if (const std::size_t bad = find_not_finite(batch.targets); bad < batch.targets.size())
        return invalid("training batch: targets hold %g at %zu, expected finite numbers",
                       static_cast<double>(batch.targets[bad]), bad);
    return {};
}

Status Trainer::step(const TrainBatch& batch, TrainStep& result) {
    SPLAT_TRY(step(batch, true));
    result = results_.back();
    results_.pop_back();
    return {};
}

Status Trainer::step(const TrainBatch& batch, bool read_it) {
    SPLAT_TRY(agreed(prepare(batch)));
    Unread& made = unread_.emplace_back();
    if (steps_ >= config_.lpips_after) made.lpips_weight = config_.lpips_weight;
    /// The optimiser knows what ran, also where something fails after it.
    struct Count {
        Trainer& trainer;
        ~Count() {
            const std::uint32_t unread = trainer.optimiser_->unread();
            trainer.attempts_ = trainer.attempts_read_ + unread;
            trainer.unread_.resize(unread);
        }
    };
    const Count count{*this};
    return cycles_now() ? attempt_cycle(batch, made, read_it) : attempt(batch, made, read_it);
}

/// Check the batch, and read what must be known before its step.
Status Trainer::prepare(const TrainBatch& batch) {
    SPLAT_TRY(entered_);
    SPLAT_TRY(check(batch));
    SPLAT_TRY(find_planes(batch));
    const std::uint64_t most =
        steps_ + unread();  // updates, if none of the unread steps was skipped
    const bool lpips_begins =
        config_.lpips_weight > 0 && steps_ < config_.lpips_after && most >= config_.lpips_after;
    return lpips_begins || optimiser_->full() ? read() : Status();
}

Status Trainer::attempt(const TrainBatch& batch, Unread& made, bool read_it) {
    vk::BatchScope scope(context_, batch_);
    const std::uint64_t sent = bytes_sent();
    Outliers outliers(passes());
    const auto slice = [&](std::uint32_t number, const nn::BetweenParts& between) {
        return pass(batch, number * config_.micro_batch, outliers, made.step, between);
    };
    SPLAT_TRY(gradients_->sum(slice, made.step.exchange_seconds));
    if (config_.scale_terms) {
        SPLAT_TRY(share(outliers));
        SPLAT_TRY(repeat_for_scales(batch, outliers, made.step));
        made.scale_loss = sum_of(outliers).loss();
    }
    SPLAT_ASSIGN(const std::vector<std::byte> notes, share_notes(made.step));
    made.step.exchange_bytes = bytes_sent() - sent;
    return agreed(update(notes, made, read_it));
}

Status Trainer::update(std::span<const std::byte> notes, Unread& made, bool read_it) {
    if (!notes.empty()) SPLAT_TRY(context_.write(optimiser_->notes(), notes.data(), notes.size()));
    context_.charge = &made.step.update_seconds;
    return optimiser_->step(made.scale_loss, read_it ? taking() : Optimiser::Use());
}

Optimiser::Use Trainer::taking() {
    return [this](std::span<const OptimiserRead> updates) { take(updates); };
}

Status Trainer::read() {
    SPLAT_TRY(entered_);
    return optimiser_->read(taking());
}

void Trainer::take(std::span<const OptimiserRead> updates) {
    std::vector<TrainStep> steps;
    for (std::size_t i = 0; i < updates.size(); ++i)
        steps.push_back(result_of(unread_[i], updates[i]));
    results_.resize(results_.size() + steps.size());
    // Nothing throws from here on.
    std::ranges::copy_backward(steps, results_.end());
    while (results_.size() > kMostResults) results_.pop_front();
    unread_.clear();
    for (const TrainStep& step : steps)
        skipped_in_a_row_ = step.skipped ? skipped_in_a_row_ + 1 : 0;
    steps_ = steps.back().step;
    attempts_ = attempts_read_ + steps.size();
    attempts_read_ = attempts_.load();
    const std::lock_guard lock(last_mutex_);
    last_ = steps.back();
}

TrainStep Trainer::result_of(const Unread& made, const OptimiserRead& update) {
    TrainStep step = made.step;
    std::span notes = update.notes;
    const double weight = static_cast<double>(1 / static_cast<float>(config_.batch_size));
    std::vector<float> losses(losses_bytes() / sizeof(float));
    for (std::uint32_t object = 0; object < config_.batch_size; ++object) {
        std::memcpy(losses.data(), notes.data(), losses_bytes());
        step.loss.add(loss_->terms_of(losses, made.lpips_weight), weight);
        notes = notes.subspan(losses.size());
    }
    const std::size_t counts = counts_bytes() / sizeof(std::uint32_t);
    for (; !notes.empty(); notes = notes.subspan(counts))
        step.non_finite += model_->output_ledger().take(notes.first(counts)).non_finite();
    step.loss.total += made.scale_loss;
    step.gradients_zero = update.step.gradients.zero;
    step.skipped = update.step.was_skipped;
    step.rate = update.step.rate;
    step.step = update.step.step;
    return step;
}

Status Trainer::set_input(const TrainBatch& batch, std::uint32_t first, TrainStep& result) {
    context_.charge = &result.network_seconds;
    const std::uint32_t all = objects_;
    const std::uint32_t objects = config_.micro_batch;
    model::ModelInput input;
    input.images = part_of(batch.images, all, first, objects);
    input.view_to_world = part_of(batch.view_to_world, all, first, objects);
    input.quaternions = part_of(batch.quaternions, all, first, objects);
    input.focals = part_of(batch.focals, all, first, objects);
    input.embedding = part_of(batch.embedding, all, first, objects);
    input.tokens = part_of(batch.tokens, all, first, objects);
    input.seed = config_.seed;
    // A distinct number for each pass of any rank; dropout depends on it.
    const std::uint64_t most = config_.most_batch() / config_.micro_batch;
    input.step = static_cast<std::uint32_t>(attempts_ * most + first_pass() + first / objects);
    return model_->set_input(input);
}

Status Trainer::pass(const TrainBatch& batch, std::uint32_t first, Outliers& outliers,
                     TrainStep& result, const nn::BetweenParts& between) {
    SPLAT_TRY(set_input(batch, first, result));
    SPLAT_TRY(model_->forward_unread());
    SPLAT_TRY(context_.run(note_counts_[first / config_.micro_batch]));
    context_.charge = &result.render_seconds;
    for (std::uint32_t slot = 0; slot < config_.micro_batch; slot += drawn_)
        SPLAT_TRY(render(batch, first, slot, result));
    if (config_.scale_terms)
        SPLAT_TRY(take_scales(first_pass() + first / config_.micro_batch, outliers));
    context_.charge = &result.network_seconds;
    return model_->backward(true, between);
}

Status Trainer::render(const TrainBatch& batch, std::uint32_t first, std::uint32_t slot,
                       TrainStep& result) {
    const raster::RasterDesc& desc = rasterizer_->desc();
    const auto cameras = part_of(batch.cameras, objects_, first + slot, drawn_);
    const std::array<float, 3> background =
        config_.white_background ? std::array<float, 3>{1, 1, 1} : std::array<float, 3>{};
    SPLAT_ASSIGN(raster::PackedViews views, raster::pack_views(desc, cameras, background));
    if (drawn_ > 1) {
        std::vector<raster::Range> ranges;
        const std::uint32_t each = desc.gaussians / drawn_;
        for (std::uint32_t view = 0; view < desc.views; ++view)
            ranges.push_back({view / config_.targets * each, each});
        SPLAT_TRY(
            raster::see_ranges(context_.device().info(), desc, desc.gaussians, ranges, views));
    }
    const bool copied = !copy_in_.empty();
    if (copied) SPLAT_TRY(context_.run(copy_in_[slot / drawn_]));
    if (cycling_) SPLAT_TRY(context_.run(join_[first + slot]));
    const auto whole = [&](const gaussians::GaussianSet& set) {
        return cycling_ ? set.views() : predicted(set);
    };
    SPLAT_TRY(rasterizer_->forward(copied ? whole(scene_) : model_->sets(), views));
    for (std::uint32_t i = 0; i < drawn_; ++i) SPLAT_TRY(compare(batch, first, slot + i));
    SPLAT_TRY(rasterizer_->backward(grad_image_.range(), grad_depth_.range(),
                                    copied ? whole(grad_scene_) : model_->sets(true)));
    if (copied) SPLAT_TRY(context_.run(copy_out_[slot / drawn_]));
    for (std::uint32_t i = 0; !planes_.empty() && i < drawn_; ++i)
        SPLAT_TRY(planes_[slot + i].backward());
    const raster::RasterStats& stats = rasterizer_->stats();
    result.pairs += stats.pairs;
    result.visible += stats.visible;
    result.culled += rasterizer_->drawn_desc().items() - stats.visible;
    return {};
}

Status Trainer::compare(const TrainBatch& batch, std::uint32_t first, std::uint32_t slot) {
    const auto part = [&](const auto& all) { return part_of(all, objects_, first + slot, 1); };
    if (sizes_)
        SPLAT_TRY(sizes_->draw(model_->set(slot), part(batch.cameras), loss_->pixel_weights()));
    SPLAT_TRY(batch.levels.empty() ? loss_->set_targets(part(batch.targets))
                                   : loss_->set_targets(part(batch.levels)));
    const auto share = static_cast<float>(cycling_ ? config_.cycle_weight : 1.0);
    const float weight = share / static_cast<float>(config_.batch_size);
    SPLAT_TRY(loss_->run(slot % drawn_, weight, unread_.back().lpips_weight));
    if (!planes_.empty()) SPLAT_TRY(planes_[slot].forward(members_[first + slot]));
    return context_.run(note_losses_[first + slot]);
}

Result<io::NamedTensors> Trainer::averaged_state() {
    SPLAT_TRY(read());
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
