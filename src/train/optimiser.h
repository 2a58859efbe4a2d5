#pragma once

#include "config/train_config.h"
#include "io/tensor_file.h"
#include "nn/parameters.h"

namespace splat::train {

/// Adam with an exponential moving average of the parameters, over the blocks of trainable ones.
///
/// Errors       kOutOfDeviceMemory; those of Context::run
/// Precision    see ops/adam.h, ops/ema.h
/// Determinism  bit-exact for any thread count
class Optimiser {
  public:
    /// The parameters must outlive it. Moments start at zero; the average starts with the first update of
    /// its schedule.
    static Result<Optimiser> create(vk::Context& context, nn::Parameters& parameters,
                                    const config::TrainConfig& config);

    /// NaN and infinite numbers among the gradients.
    Result<std::uint64_t> count_not_finite();

    /// One update from the gradients, at the rate of the configuration's schedule.
    Status step();

    /// Updates done.
    [[nodiscard]] std::uint64_t steps() const { return steps_; }

    /// A copy of a parameter's averaged values, or of the parameter without averaging.
    Status read_average(const nn::Parameter& parameter, LargeVector<float>& values);

    /// Moments and averages of trainable parameters as "m:NAME", "v:NAME" and "ema:NAME".
    Status save(io::NamedTensors& tensors);

    /// Check the state to load. Errors: kInvalidArgument for a tensor that is missing or of another size.
    Status check(const io::NamedTensors& tensors) const;

    /// Load the state; errors as check().
    Status load(const io::NamedTensors& tensors, std::uint64_t steps);

  private:
    /// State of one block of parameters, in the layout of its values.
    struct State {
        vk::Buffer m, v, average, partial;
        std::size_t adam = 0, ema = 0;  ///< dispatches of the lists
    };
    struct Kind {
        const char* prefix;
        vk::Buffer State::*buffer;
    };
    [[nodiscard]] std::vector<Kind> kinds() const;
    Optimiser(vk::Context& context, nn::Parameters& parameters, const config::TrainConfig& config)
        : context_(&context), parameters_(&parameters), config_(config) {}
    Status allocate();
    Status record();
    /// The part of a block's buffer that belongs to a parameter; nullptr block if it is frozen.
    [[nodiscard]] vk::BufferView part(const nn::Parameter& parameter,
                                      vk::Buffer State::*buffer) const;

    vk::Context* context_;
    nn::Parameters* parameters_;
    config::TrainConfig config_;
    std::vector<State> states_;
    vk::CommandList adam_, ema_, stats_;
    std::uint64_t steps_ = 0;
};

}  // namespace splat::train
