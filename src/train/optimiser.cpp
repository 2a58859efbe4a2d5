#include "train/optimiser.h"

#include <algorithm>
#include <cmath>

#include "ops/adam.h"
#include "ops/tensor_stats.h"

namespace splat::train {
namespace {

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
    Optimiser optimiser(context, std::move(desc));
    optimiser.make_runs();
    SPLAT_TRY(optimiser.allocate());
    SPLAT_ASSIGN(optimiser.lists_, optimiser.record(optimiser.used()));
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
    for (Run& run : runs_) {
        SPLAT_TRY(make(run.m, run.values.bytes));
        SPLAT_TRY(make(run.v, run.values.bytes));
        if (desc_.ema) SPLAT_TRY(make(run.average, run.values.bytes));
        SPLAT_TRY(make(run.partial, ops::tensor_stats_partial_bytes(run.elements)));
    }
    return {};
}

Result<Optimiser::Lists> Optimiser::record(std::span<const Used> runs) {
    Lists lists;
    if (runs.empty()) return lists;
    vk::Recorder adam(*context_);
    vk::Recorder ema(*context_);
    vk::Recorder stats(*context_);
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const auto& [values, grads, elements] = runs[i];
        const Run& run = runs_[i];
        const vk::BufferView m = run.m.range().part(0, values.bytes);
        const vk::BufferView v = run.v.range().part(0, values.bytes);
        SPLAT_TRY(ops::adam(adam, {}, values, grads, m, v));
        SPLAT_TRY(ops::tensor_stats(stats, elements, grads, run.partial.range()));
        if (desc_.ema)
            SPLAT_TRY(ops::ema(ema, 0, values, run.average.range().part(0, values.bytes)));
    }
    SPLAT_ASSIGN(lists.adam, adam.finish());
    SPLAT_ASSIGN(lists.stats, stats.finish());
    SPLAT_ASSIGN(lists.ema, ema.finish());
    return lists;
}

Result<GradientStats> Optimiser::measure_gradients() {
    GradientStats all;
    if (runs_.empty()) return all;
    SPLAT_TRY(context_->run(lists_.stats));
    std::vector<std::uint32_t> partial;
    for (const Run& run : runs_) {
        partial.resize(ops::tensor_stats_partial_bytes(run.elements) / 4);
        SPLAT_TRY(context_->read(run.partial.range(), partial.data(), partial.size() * 4));
        const ops::TensorStats stats = ops::tensor_stats_merge(partial);
        const std::uint64_t broken = stats.nan_count + stats.inf_count;
        all.non_finite += broken;
        all.zero = all.zero && broken == 0 && stats.min == 0 && stats.max == 0;
    }
    return all;
}

Status Optimiser::zero_gradients() {
    if (runs_.empty()) return {};
    vk::Recorder recorder(*context_);
    for (const Run& run : runs_) SPLAT_TRY(recorder.fill(run.grads.part(0, run.m.bytes()), 0));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    return context_->run(list);
}

Status Optimiser::step(OptimiserStep& result, double loss) {
    OptimiserStep made;
    made.rate = rate();
    SPLAT_ASSIGN(made.gradients, measure_gradients());
    made.was_skipped = made.gradients.non_finite > 0 || !std::isfinite(loss);
    if (made.was_skipped)
        ++skipped_;
    else
        SPLAT_TRY(update(made.rate));
    made.step = steps_;
    made.skipped = skipped_;
    result = made;
    return {};
}

Status Optimiser::update(double rate) {
    const vk::Uncancelled whole(context_->mutex);
    const vk::DeviceInfo& device = context_->device().info();
    const std::uint64_t step = steps_ + 1;
    for (const OptimiserRule& rule : desc_.rules)
        SPLAT_TRY(ops::adam_check(adam_desc(rule, step, rate)));
    const auto decay =
        desc_.ema && !runs_.empty() ? ops::ema_decay(steps_, *desc_.ema) : std::nullopt;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
        const std::uint64_t bytes = runs_[i].values.bytes;
        const ops::AdamDesc desc = adam_desc(desc_.rules[runs_[i].rule], step, rate);
        SPLAT_TRY(lists_.adam.set_push(i, ops::adam_params(device, desc, bytes)));
        if (decay) SPLAT_TRY(lists_.ema.set_push(i, ops::ema_params(device, *decay, bytes)));
    }
    if (decay) SPLAT_TRY(context_->make_ready(lists_.ema));
    if (!runs_.empty()) SPLAT_TRY(context_->run(lists_.adam));
    for (nn::Parameters* container : desc_.containers) container->changed();
    if (decay) SPLAT_TRY(context_->run(lists_.ema));
    ++steps_;
    return {};
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
