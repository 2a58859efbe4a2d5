#include "config/train_config.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splat::config {

double TrainConfig::rate(std::uint64_t step) const {
    const auto at = static_cast<double>(step);
    if (step <= warmup) return learning_rate * at / static_cast<double>(warmup + 1);
    if (schedule == Schedule::kStep && step_lr_at > 0 && step >= step_lr_at)
        return learning_rate / 10;
    if (schedule != Schedule::kCosine || iterations <= warmup) return learning_rate;
    const double done = std::min(
        1.0, (at - static_cast<double>(warmup) - 1) / static_cast<double>(iterations - warmup));
    return learning_rate * (1 + std::cos(std::numbers::pi * done)) / 2;
}

std::size_t TrainConfig::stage_after(std::uint64_t updates) const {
    std::size_t stage = 0;
    while (stage + 1 < stages.size() && updates >= end_of(stage)) ++stage;
    return stage;
}

std::uint64_t TrainConfig::end_of(std::size_t stage) const {
    if (stage + 1 >= stages.size()) return iterations;
    std::uint64_t end = 0;
    for (std::size_t i = 0; i <= stage; ++i) end += stages[i].iterations;
    return end;
}

TrainConfig TrainConfig::in_stage(std::size_t stage) const {
    if (stages.empty()) return *this;
    TrainConfig made = stages[stage];
    made.iterations = iterations;
    made.stages = stages;
    return made;
}

std::uint32_t TrainConfig::most_batch() const {
    std::uint32_t most = stages.empty() ? batch_size : 0;
    for (const TrainConfig& each : stages) most = std::max(most, each.batch_size);
    return most;
}

bool TrainConfig::weighs(double TrainConfig::*weight) const {
    if (stages.empty()) return this->*weight > 0;
    return std::ranges::any_of(stages, [&](const TrainConfig& each) { return each.*weight > 0; });
}

}  // namespace splat::config
