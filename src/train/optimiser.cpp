#include "train/optimiser.h"

#include <algorithm>

#include "ops/adam.h"
#include "ops/ema.h"
#include "ops/tensor_stats.h"

namespace splat::train {

Result<Optimiser> Optimiser::create(vk::Context& context, nn::Parameters& parameters,
                                    const config::TrainConfig& config) {
    Optimiser optimiser(context, parameters, config);
    SPLAT_TRY(optimiser.allocate());
    SPLAT_TRY(optimiser.record());
    return optimiser;
}

Status Optimiser::allocate() {
    const auto make = [&](vk::Buffer& buffer, std::uint64_t bytes) -> Status {
        SPLAT_ASSIGN(buffer, context_->memory().allocate(bytes, vk::MemoryKind::kDevice,
                                                         "state of the optimiser"));
        return context_->fill(buffer.range(), 0);
    };
    for (const nn::ParameterBlock& block : parameters_->blocks()) {
        State& state = states_.emplace_back();
        SPLAT_TRY(make(state.m, block.values.bytes));
        SPLAT_TRY(make(state.v, block.values.bytes));
        if (config_.ema) SPLAT_TRY(make(state.average, block.values.bytes));
        SPLAT_TRY(make(state.partial, ops::tensor_stats_partial_bytes(block.grads.bytes / 4)));
    }
    return {};
}

Status Optimiser::record() {
    if (states_.empty()) return {};
    const auto blocks = parameters_->blocks();
    vk::Recorder adam(*context_);
    vk::Recorder ema(*context_);
    vk::Recorder stats(*context_);
    for (std::size_t i = 0; i < states_.size(); ++i) {
        State& state = states_[i];
        SPLAT_TRY(ops::adam(adam, {}, blocks[i].values, blocks[i].grads, state.m.range(),
                            state.v.range()));
        state.adam = adam.last_dispatch();
        SPLAT_TRY(ops::tensor_stats(stats, blocks[i].grads.bytes / 4, blocks[i].grads,
                                    state.partial.range()));
        if (!config_.ema) continue;
        SPLAT_TRY(ops::ema(ema, 0, blocks[i].values, state.average.range()));
        state.ema = ema.last_dispatch();
    }
    SPLAT_ASSIGN(adam_, adam.finish());
    SPLAT_ASSIGN(stats_, stats.finish());
    if (config_.ema) {
        SPLAT_ASSIGN(ema_, ema.finish());
    }
    return {};
}

Result<std::uint64_t> Optimiser::count_not_finite() {
    if (states_.empty()) return std::uint64_t{0};
    SPLAT_TRY(context_->run(stats_));
    std::uint64_t count = 0;
    std::vector<std::uint32_t> partial;
    for (const State& state : states_) {
        partial.resize(state.partial.bytes() / 4);
        SPLAT_TRY(context_->read(state.partial.range(), partial.data(), partial.size() * 4));
        const ops::TensorStats stats = ops::tensor_stats_merge(partial);
        count += stats.nan_count + stats.inf_count;
    }
    return count;
}

Status Optimiser::step() {
    ops::AdamDesc desc;
    desc.step = steps_ + 1;
    desc.learning_rate = config_.rate(steps_ + 1);
    desc.beta1 = config_.betas[0];
    desc.beta2 = config_.betas[1];
    desc.eps = config_.eps;
    SPLAT_TRY(ops::adam_check(desc));
    const vk::DeviceInfo& device = context_->device().info();
    const auto blocks = parameters_->blocks();
    for (std::size_t i = 0; i < states_.size(); ++i)
        SPLAT_TRY(adam_.set_push(states_[i].adam,
                                 ops::adam_params(device, desc, blocks[i].values.bytes)));
    const ops::EmaSchedule schedule{config_.ema_every, config_.ema_after, config_.ema_most};
    const auto decay = config_.ema ? ops::ema_decay(steps_, schedule) : std::nullopt;
    if (decay) {
        for (std::size_t i = 0; i < states_.size(); ++i)
            SPLAT_TRY(ema_.set_push(states_[i].ema,
                                    ops::ema_params(device, *decay, blocks[i].values.bytes)));
        SPLAT_TRY(context_->make_ready(ema_));
    }
    SPLAT_TRY(context_->run(adam_));
    parameters_->changed();
    if (decay) SPLAT_TRY(context_->run(ema_));
    ++steps_;
    return {};
}

vk::BufferView Optimiser::part(const nn::Parameter& parameter, vk::Buffer State::*buffer) const {
    const auto blocks = parameters_->blocks();
    for (std::size_t i = 0; i < states_.size(); ++i) {
        const vk::BufferView& values = blocks[i].values;
        if (!values.overlaps(parameter.value)) continue;
        vk::BufferView view = (states_[i].*buffer).range();
        view.offset += parameter.value.offset - values.offset;
        view.bytes = parameter.value.bytes;
        view.shape = parameter.shape;
        return view;
    }
    return {};
}

Status Optimiser::read_average(const nn::Parameter& parameter, LargeVector<float>& values) {
    const bool averaged = config_.ema && parameter.trainable && steps_ > 0;
    return parameters_->read(averaged ? part(parameter, &State::average) : parameter.value, values);
}

Status Optimiser::save(io::NamedTensors& tensors) {
    for (const nn::Parameter& parameter : parameters_->all()) {
        if (!parameter.trainable) continue;
        for (const Kind& kind : kinds()) {
            io::NamedTensor tensor;
            tensor.name = kind.prefix + parameter.name;
            SPLAT_TRY(parameters_->read(part(parameter, kind.buffer), tensor.values.own()));
            tensor.dims = {static_cast<std::int64_t>(tensor.values.size())};
            SPLAT_TRY(tensors.add(std::move(tensor)));
        }
    }
    return {};
}

std::vector<Optimiser::Kind> Optimiser::kinds() const {
    std::vector<Kind> kinds = {{"m:", &State::m}, {"v:", &State::v}};
    if (config_.ema) kinds.push_back({"ema:", &State::average});
    return kinds;
}

Status Optimiser::check(const io::NamedTensors& tensors) const {
    for (const nn::Parameter& parameter : parameters_->all()) {
        for (const Kind& kind : kinds()) {
            const io::NamedTensor* tensor = tensors.find(kind.prefix + parameter.name);
            const bool fits =
                tensor != nullptr && tensor->values.size() == parameter.shape.elements();
            if (fits || !parameter.trainable) continue;
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
    for (const nn::Parameter& parameter : parameters_->all()) {
        if (!parameter.trainable) continue;
        for (const Kind& kind : kinds()) {
            const io::TensorValues& values = tensors.find(kind.prefix + parameter.name)->values;
            SPLAT_TRY(context_->write(part(parameter, kind.buffer), values.data(),
                                      values.size() * sizeof(float)));
        }
    }
    steps_ = steps;
    return {};
}

}  // namespace splat::train
