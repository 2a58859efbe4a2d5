#include "train/optimiser.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/checked_math.h"
#include "ops/adam.h"
#include "ops/tensor_stats.h"

namespace splat::train {
namespace {

/// The largest offset alignment that Vulkan allows a device.
constexpr std::uint64_t kAlignment = 256;

ops::AdamDesc adam_desc(const OptimiserRule& rule, std::uint64_t step, double rate) {
    ops::AdamDesc desc;
    desc.step = step;
    desc.learning_rate = rate * rule.rate_factor;
    desc.beta1 = rule.betas[0];
    desc.beta2 = rule.betas[1];
    desc.eps = rule.eps;
    return desc;
}

}  // namespace

Status add_parameters(OptimiserDesc& desc, nn::Parameters& from, const std::string& prefix) {
    // Blocks of all containers have different numbers.
    std::size_t first = 1;
    for (const OptimiserParameter& parameter : desc.parameters)
        first = std::max(first, parameter.block + 1);
    for (const nn::Parameter& parameter : from.all()) {
        if (!parameter.trainable) continue;
        if (parameter.grad.buffer == VK_NULL_HANDLE)
            return bad_state(
                "parameter '%s' has no gradient: its network was made without gradients",
                (prefix + parameter.name).c_str());
        OptimiserParameter& added = desc.parameters.emplace_back();
        added.name = prefix + parameter.name;
        added.shape = parameter.shape;
        added.value = parameter.value;
        added.grad = parameter.grad;
        const auto blocks = from.blocks();
        for (std::size_t i = 0; i < blocks.size(); ++i)
            if (blocks[i].values.overlaps(parameter.value)) added.block = first + i;
    }
    desc.containers.push_back(&from);
    return {};
}

Result<Optimiser> Optimiser::create(vk::Context& context, OptimiserDesc desc) {
    for (const OptimiserRule& rule : desc.rules) SPLAT_TRY(ops::adam_check(adam_desc(rule, 1, 1)));
    for (OptimiserParameter& parameter : desc.parameters) {
        parameter.capacity = parameter.rows();
        if (parameter.value.bytes != parameter.grad.bytes)
            return error(Code::kShape,
                         "parameter '%s' has %llu bytes and its gradient %llu, expected the same",
                         parameter.name.c_str(), llu(parameter.value.bytes),
                         llu(parameter.grad.bytes));
    }
    desc.notes.bytes =
        std::max<std::uint64_t>(desc.notes.bytes, 16);  // an empty view binds nothing
    Optimiser optimiser(context, std::move(desc));
    optimiser.make_runs();
    SPLAT_TRY(optimiser.allocate());
    SPLAT_ASSIGN(optimiser.list_, optimiser.record(optimiser.used()));
    return optimiser;
}

void Optimiser::make_runs() {
    std::size_t block = 0;  // block of the last run
    for (const OptimiserParameter& parameter : desc_.parameters) {
        const bool joins = !runs_.empty() && parameter.block != 0 && parameter.block == block &&
                           runs_.back().rule == parameter.rule;
        if (!joins) {
            Run& run = runs_.emplace_back();
            run.values = parameter.value;
            run.grads = parameter.grad;
            run.rule = parameter.rule;
            run.elements = parameter.shape.elements();
        } else {
            Run& run = runs_.back();
            run.values.bytes = parameter.value.end() - run.values.offset;
            run.grads.bytes = parameter.grad.end() - run.grads.offset;
            run.elements = run.grads.bytes / 4;
            run.values.shape = run.grads.shape = {static_cast<std::uint32_t>(run.elements)};
            SPLAT_ASSERT(run.values.bytes == run.grads.bytes);
        }
        block = parameter.block;
        run_of_.push_back(runs_.size() - 1);
    }
}

Status Optimiser::allocate() {
    const auto make = [&](vk::Buffer& buffer, std::uint64_t bytes) -> Status {
        SPLAT_ASSIGN(buffer, context_->memory().allocate(bytes, vk::MemoryKind::kDevice,
                                                         "state of the optimiser"));
        return context_->fill(buffer.range(), 0);
    };
    const std::uint64_t entry = 32 * desc_.rules.size() + 16;
    SPLAT_TRY(make(scalars_, round_up(entry - 16, kAlignment) + kAlignment));
    SPLAT_TRY(make(notes_, desc_.notes.bytes));
    SPLAT_TRY(make(inputs_, 16 + entry * desc_.most_unread));
    SPLAT_TRY(make(history_, row_bytes() * desc_.most_unread));
    std::uint64_t partial = 0;
    for (const Run& run : runs_)
        partial += round_up(ops::tensor_stats_partial_bytes(run.elements), kAlignment);
    SPLAT_TRY(make(partial_, std::max(partial, kAlignment)));
    partial = 0;
    for (Run& run : runs_) {
        SPLAT_TRY(make(run.m, run.values.bytes));
        SPLAT_TRY(make(run.v, run.values.bytes));
        if (desc_.ema) SPLAT_TRY(make(run.average, run.values.bytes));
        run.partial = partial_.range().part(partial, ops::tensor_stats_partial_bytes(run.elements));
        partial += round_up(run.partial.bytes, kAlignment);
    }
    return {};
}

Result<vk::CommandList> Optimiser::record(std::span<const Used> runs) {
    vk::Recorder recorder(*context_);
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const vk::BufferView& partial = runs_[i].partial;
        SPLAT_TRY(ops::tensor_stats(recorder, runs[i].elements, runs[i].grads, partial));
        const std::uint64_t used = ops::tensor_stats_partial_bytes(runs[i].elements);
        if (used < partial.bytes)
            SPLAT_TRY(recorder.fill(partial.part(used, partial.bytes - used), 0));
    }
    ops::StepDecision decision;
    decision.partial = partial_.range();
    decision.notes = notes_.range();
    decision.checked = desc_.notes.checked;
    decision.block = desc_.notes.block;
    decision.unchecked = desc_.notes.unchecked;
    decision.inputs = inputs_.range();
    decision.rules = static_cast<std::uint32_t>(desc_.rules.size());
    decision.history = history_.range();
    decision.scalars = scalars_.range();
    decision.ema_at = scalars_.bytes() - kAlignment;
    SPLAT_TRY(ops::step_decision(recorder, decision));
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const auto& [values, grads, elements] = runs[i];
        const Run& run = runs_[i];
        const ops::AdamScalars scalars{scalars_.range(), static_cast<std::uint32_t>(run.rule)};
        SPLAT_TRY(ops::adam(recorder, scalars, values, grads, run.m.range().part(0, values.bytes),
                            run.v.range().part(0, values.bytes)));
    }
    for (std::size_t i = 0; desc_.ema && i < runs.size(); ++i)
        SPLAT_TRY(ops::ema(recorder, ema_scalars(), runs[i].values,
                           runs_[i].average.range().part(0, runs[i].values.bytes)));
    return recorder.finish();
}

Status Optimiser::zero_gradients() {
    vk::BatchScope scope(*context_, *batch_);
    for (const Run& run : runs_) SPLAT_TRY(context_->fill(run.grads.part(0, run.m.bytes()), 0));
    return scope.finish();
}

/// The place of the step's row, the loss, and the scalars of each update that it may be.
Status Optimiser::write_inputs(double loss) {
    std::vector<float> numbers(inputs_.bytes() / sizeof(float));
    numbers[0] = std::bit_cast<float>(unread_);
    numbers[1] = std::isfinite(loss) ? 0 : std::numeric_limits<float>::infinity();
    auto to = numbers.begin() + 4;
    const auto append = [&to](const auto& scalars) { to = std::ranges::copy(scalars, to).out; };
    for (std::uint64_t before = steps_; before <= steps_ + unread_; ++before) {
        for (const OptimiserRule& rule : desc_.rules) {
            SPLAT_ASSIGN(const auto adam, ops::adam_scalars(adam_desc(
                                              rule, before + 1, desc_.schedule.rate(before + 1))));
            append(adam);
        }
        SPLAT_ASSIGN(const auto ema, ops::ema_scalars(desc_.ema ? ops::ema_decay(before, *desc_.ema)
                                                                : std::nullopt));
        append(ema);
    }
    return context_->write(inputs_.range(), numbers.data(), inputs_.bytes());
}

void Optimiser::explain(std::span<const std::uint32_t> rows, std::span<OptimiserRead> steps) const {
    std::uint64_t updates = steps_, skipped = skipped_;
    for (auto& [made, notes] : steps) {
        const std::span row = rows.first(row_bytes() / sizeof(std::uint32_t));
        rows = rows.subspan(row.size());
        notes = row.subspan(4);
        made.rate = desc_.schedule.rate(updates + 1);
        made.was_skipped = row[0] != 0;
        made.gradients = {row[2], row[3] != 0};
        ++(made.was_skipped ? skipped : updates);
        made.step = updates;
        made.skipped = skipped;
    }
}

Status Optimiser::read_later(std::uint32_t rows, const Use& use) {
    std::vector<std::uint32_t> words(rows * row_bytes() / sizeof(std::uint32_t));
    std::vector<OptimiserRead> steps(rows);
    auto take_all = [this, use, words = std::move(words),
                     steps = std::move(steps)](std::span<const std::byte> bytes) mutable {
        unread_ = static_cast<std::uint32_t>(steps.size());  // they ran, also if `use` throws
        std::memcpy(words.data(), bytes.data(), bytes.size());
        explain(words, steps);
        use(steps);
        steps_ = steps.back().step.step;
        skipped_ = steps.back().step.skipped;
        unread_ = 0;
    };
    return context_->read_later(history_.range(), rows * row_bytes(), std::move(take_all));
}

Status Optimiser::step(double loss, const Use& use) {
    SPLAT_ASSERT(!full());
    vk::BatchScope scope(*context_, *batch_);
    SPLAT_TRY(write_inputs(loss));
    // Else the read would run the update, and could still fail.
    const bool joined = use && context_->stages((unread_ + 1) * row_bytes());
    {
        const vk::Uncancelled whole(context_->mutex);  // all is updated, or nothing
        SPLAT_TRY(context_->run(list_));
    }
    for (nn::Parameters* container : desc_.containers) container->changed();
    if (joined) SPLAT_TRY(read_later(unread_ + 1, use));
    SPLAT_TRY(context_->flush());
    if (joined) return {};
    ++unread_;
    const vk::Uncancelled whole(context_->mutex);  // the step is done
    return use ? read(use) : Status();
}

Status Optimiser::step(OptimiserStep& result) {
    const Use use = [&result](std::span<const OptimiserRead> all) { result = all.back().step; };
    SPLAT_TRY(read(use));  // what a call before could not read
    return step(0, use);
}

Status Optimiser::read(const Use& use) {
    if (unread_ == 0) return {};
    vk::BatchScope scope(*context_, *batch_);
    SPLAT_TRY(read_later(unread_, use));
    return context_->flush();
}

vk::BufferView Optimiser::ema_scalars() const {
    return scalars_.range().part(scalars_.bytes() - kAlignment, 16);
}

vk::BufferView Optimiser::part(std::size_t index, vk::Buffer Run::*buffer) const {
    const OptimiserParameter& parameter = desc_.parameters[index];
    const Run& run = runs_[run_of_[index]];
    vk::BufferView view =
        (run.*buffer)
            .range()
            .part(parameter.value.offset - run.values.offset, parameter.value.bytes);
    view.shape = parameter.shape;
    return view;
}

}  // namespace splat::train
