#include "train/optimiser.h"

#include <algorithm>

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
            return error(Code::kInvalidState,
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
    for (const OptimiserParameter& parameter : desc.parameters)
        if (parameter.value.bytes != parameter.grad.bytes)
            return error(Code::kShape,
                         "parameter '%s' has %llu bytes and its gradient %llu, expected the same",
                         parameter.name.c_str(),
                         static_cast<unsigned long long>(parameter.value.bytes),
                         static_cast<unsigned long long>(parameter.grad.bytes));
    Optimiser optimiser(context, std::move(desc));
    optimiser.make_runs();
    SPLAT_TRY(optimiser.allocate());
    SPLAT_TRY(optimiser.record());
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

Status Optimiser::record() {
    if (runs_.empty()) return {};
    vk::Recorder adam(*context_);
    vk::Recorder ema(*context_);
    vk::Recorder stats(*context_);
    for (Run& run : runs_) {
        SPLAT_TRY(ops::adam(adam, {}, run.values, run.grads, run.m.range(), run.v.range()));
        run.adam = adam.last_dispatch();
        SPLAT_TRY(ops::tensor_stats(stats, run.elements, run.grads, run.partial.range()));
        if (!desc_.ema) continue;
        SPLAT_TRY(ops::ema(ema, 0, run.values, run.average.range()));
        run.ema = ema.last_dispatch();
    }
    SPLAT_ASSIGN(adam_, adam.finish());
    SPLAT_ASSIGN(stats_, stats.finish());
    if (desc_.ema) {
        SPLAT_ASSIGN(ema_, ema.finish());
    }
    return {};
}

Result<GradientStats> Optimiser::measure_gradients() {
    GradientStats all;
    if (runs_.empty()) return all;
    SPLAT_TRY(context_->run(stats_));
    std::vector<std::uint32_t> partial;
    for (const Run& run : runs_) {
        partial.resize(run.partial.bytes() / 4);
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
    for (const Run& run : runs_) SPLAT_TRY(recorder.fill(run.grads, 0));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    return context_->run(list);
}

Status Optimiser::step(double rate) {
    const vk::DeviceInfo& device = context_->device().info();
    for (const OptimiserRule& rule : desc_.rules)
        SPLAT_TRY(ops::adam_check(adam_desc(rule, steps_ + 1, rate)));
    for (const Run& run : runs_)
        SPLAT_TRY(adam_.set_push(
            run.adam, ops::adam_params(device, adam_desc(desc_.rules[run.rule], steps_ + 1, rate),
                                       run.values.bytes)));
    const auto decay =
        desc_.ema && !runs_.empty() ? ops::ema_decay(steps_, *desc_.ema) : std::nullopt;
    if (decay) {
        for (const Run& run : runs_)
            SPLAT_TRY(ema_.set_push(run.ema, ops::ema_params(device, *decay, run.values.bytes)));
        SPLAT_TRY(context_->make_ready(ema_));
    }
    if (!runs_.empty()) SPLAT_TRY(context_->run(adam_));
    for (nn::Parameters* container : desc_.containers) container->changed();
    if (decay) SPLAT_TRY(context_->run(ema_));
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

Status Optimiser::read(const vk::BufferView& view, LargeVector<float>& values) {
    values.resize(view.shape.elements());
    return context_->read(view, values.data(), values.size() * sizeof(float));
}

Status Optimiser::read_average(const OptimiserParameter& parameter, LargeVector<float>& values) {
    const auto index = static_cast<std::size_t>(&parameter - desc_.parameters.data());
    const bool averaged = desc_.ema && steps_ > 0;
    return read(averaged ? part(index, &Run::average) : parameter.value, values);
}

Status Optimiser::save(io::NamedTensors& tensors) {
    for (std::size_t i = 0; i < desc_.parameters.size(); ++i) {
        for (const Kind& kind : kinds()) {
            io::NamedTensor tensor;
            tensor.name = kind.prefix + desc_.parameters[i].name;
            SPLAT_TRY(read(part(i, kind.buffer), tensor.values.own()));
            tensor.dims = {static_cast<std::int64_t>(tensor.values.size())};
            SPLAT_TRY(tensors.add(std::move(tensor)));
        }
    }
    return {};
}

std::vector<Optimiser::Kind> Optimiser::kinds() const {
    std::vector<Kind> kinds = {{"m:", &Run::m}, {"v:", &Run::v}};
    if (desc_.ema) kinds.push_back({"ema:", &Run::average});
    return kinds;
}

Status Optimiser::check(const io::NamedTensors& tensors) const {
    for (const OptimiserParameter& parameter : desc_.parameters) {
        for (const Kind& kind : kinds()) {
            const io::NamedTensor* tensor = tensors.find(kind.prefix + parameter.name);
            if (tensor != nullptr && tensor->values.size() == parameter.shape.elements()) continue;
            return error(Code::kInvalidArgument,
                         "checkpoint: '%s%s' %s, expected %llu numbers: it is of another "
                         "configuration",
                         kind.prefix, parameter.name.c_str(),
                         tensor == nullptr ? "is missing" : "has another size",
                         static_cast<unsigned long long>(parameter.shape.elements()));
        }
    }
    return {};
}

Status Optimiser::load(const io::NamedTensors& tensors, std::uint64_t steps) {
    SPLAT_TRY(check(tensors));
    for (std::size_t i = 0; i < desc_.parameters.size(); ++i) {
        for (const Kind& kind : kinds()) {
            const io::TensorValues& values =
                tensors.find(kind.prefix + desc_.parameters[i].name)->values;
            SPLAT_TRY(context_->write(part(i, kind.buffer), values.data(),
                                      values.size() * sizeof(float)));
        }
    }
    steps_ = steps;
    return {};
}

}  // namespace splat::train
