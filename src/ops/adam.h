#pragma once

#include "params/optimiser_params.h"
#include "vk/recorder.h"

namespace splat::ops {

struct AdamDesc {
    std::uint64_t step = 1;  ///< number of this update, counted from 1
    double learning_rate = 5e-5;
    double beta1 = 0.9;
    double beta2 = 0.999;
    double eps = 1e-15;
};

/// Errors: kInvalidArgument for step 0, betas outside of [0, 1), a rate that is negative or not finite, or an
/// eps that is not a normal float > 0.
Status adam_check(const AdamDesc& desc);

/// The push constants of a step on a block of `bytes` bytes. With CommandList::set_push a recorded list
/// runs for one step after another.
params::AdamParams adam_params(const vk::DeviceInfo& device, const AdamDesc& desc,
                               std::uint64_t bytes);

/// One step of Adam, without weight decay, on a whole block of parameters in one dispatch, in place.
///
///   m = beta1 m + (1 - beta1) g       v = beta2 v + (1 - beta2) g^2
///   value -= rate / (1 - beta1^step) * m / (sqrt(v / (1 - beta2^step)) + eps)
///
/// value, grad, m, v   float32 blocks of the same length; every quad is updated, so padding between
///              parameters must be finite; with gradient 0 and moments 0 it does not change
/// Errors       those of adam_check; kShape for lengths that differ; the recorder's beyond the device's
///              binding limits; nothing is recorded on error
/// Precision    a few roundings of the step, one of the value (tests/ops/adam_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Kingma & Ba 2015, arXiv:1412.6980, algorithm 1
Status adam(vk::Recorder& recorder, const AdamDesc& desc, const vk::BufferView& value,
            const vk::BufferView& grad, const vk::BufferView& m, const vk::BufferView& v);

}  // namespace splat::ops
