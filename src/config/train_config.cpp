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

}  // namespace splat::config
