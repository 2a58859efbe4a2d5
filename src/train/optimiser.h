#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/tensor_file.h"
#include "nn/parameters.h"
#include "ops/ema.h"

namespace splat::train {

/// What is wrong with the gradients of a step.
struct GradientStats {
    std::uint64_t non_finite = 0;  ///< NaN and infinite numbers
    bool zero = true;              ///< all of them, so that a step teaches nothing
};

/// Adam's numbers for a group of parameters.
struct OptimiserRule {
    double rate_factor = 1;  ///< multiplies the step's rate
    std::array<double, 2> betas = {0.9, 0.999};
    double eps = 1e-15;
};

/// A float32 parameter, its gradient of the same size, and the rule that updates it.
struct OptimiserParameter {
    std::string name;
    Shape shape;
    vk::BufferView value, grad;
    std::size_t rule = 0;
    /// Neighbours of one block and rule are updated in one dispatch, with the padding between them; 0: alone.
    std::size_t block = 0;
};

struct OptimiserDesc {
    std::vector<OptimiserParameter> parameters;
    std::vector<OptimiserRule> rules = {OptimiserRule()};
    std::optional<ops::EmaSchedule> ema;      ///< empty: no averages
    std::vector<nn::Parameters*> containers;  ///< told of changes; they must outlive the optimiser
};

/// Append the trainable parameters of `from`, named `prefix` and their name, and `from` itself. Errors:
/// kInvalidState if it was made without gradients.
Status add_parameters(OptimiserDesc& desc, nn::Parameters& from, const std::string& prefix = "");

/// Adam with an exponential moving average of the parameters.
///
/// Errors       kOutOfDeviceMemory; those of Context::run
/// Precision    see ops/adam.h, ops/ema.h
/// Determinism  bit-exact for any thread count
class Optimiser {
  public:
    /// The parameters' memory must outlive it. Moments start at zero; the average starts with the first
    /// update of its schedule.
    ///
    /// Errors: kInvalidArgument for a rule outside Adam's range, kShape for a gradient of another size than
    /// its parameter.
    static Result<Optimiser> create(vk::Context& context, OptimiserDesc desc);

    Result<GradientStats> measure_gradients();

    /// Set all gradients to zero.
    Status zero_gradients();

    /// One update from the gradients. Errors: kInvalidArgument for a rate that is negative or not finite.
    Status step(double rate);

    /// Updates done.
    [[nodiscard]] std::uint64_t steps() const { return steps_; }

    [[nodiscard]] const std::vector<OptimiserParameter>& parameters() const {
        return desc_.parameters;
    }

    [[nodiscard]] bool averages() const { return desc_.ema.has_value(); }

    /// Copy a parameter's averaged values, or without averages its own.
    Status read_average(const OptimiserParameter& parameter, LargeVector<float>& values);

    /// Moments and averages as "m:NAME", "v:NAME" and "ema:NAME".
    Status save(io::NamedTensors& tensors);

    /// Check the state to load. Errors: kInvalidArgument for a tensor that is missing or of another size.
    Status check(const io::NamedTensors& tensors) const;

    /// Load the state; errors as check().
    Status load(const io::NamedTensors& tensors, std::uint64_t steps);

  private:
    /// Parameters that one dispatch updates, and their state in the layout of the values.
    struct Run {
        vk::BufferView values, grads;
        std::size_t rule = 0;
        std::uint64_t elements = 0;  ///< gradients to measure
        vk::Buffer m, v, average, partial;
        std::size_t adam = 0, ema = 0;  ///< dispatches of the lists
    };
    struct Kind {
        const char* prefix;
        vk::Buffer Run::*buffer;
    };
    [[nodiscard]] std::vector<Kind> kinds() const;
    Optimiser(vk::Context& context, OptimiserDesc desc)
        : context_(&context), desc_(std::move(desc)) {}
    void make_runs();
    Status allocate();
    Status record();
    Status read(const vk::BufferView& view, LargeVector<float>& values);
    /// The part of its run's buffer that belongs to parameter `index`.
    [[nodiscard]] vk::BufferView part(std::size_t index, vk::Buffer Run::*buffer) const;

    vk::Context* context_;
    OptimiserDesc desc_;
    std::vector<Run> runs_;
    std::vector<std::size_t> run_of_;  ///< by parameter
    vk::CommandList adam_, ema_, stats_;
    std::uint64_t steps_ = 0;
};

}  // namespace splat::train
