#pragma once

#include <array>

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

/// The scalars of a step, for a buffer that recorded dispatches read; with another last number than 0, adam() changes
/// nothing. Errors: those of adam_check.
Result<std::array<float, 8>> adam_scalars(const AdamDesc& desc);

/// Where adam() reads its scalars: those of adam_scalars from byte 32 * rule on.
struct AdamScalars {
    vk::BufferView values;
    std::uint32_t rule = 0;
};

/// One step of Adam, without weight decay, on a whole block of parameters in one dispatch, in place.
///
///   m = beta1 m + (1 - beta1) g       v = beta2 v + (1 - beta2) g^2
///   value -= rate / (1 - beta1^step) * m / (sqrt(v / (1 - beta2^step)) + eps)
///
/// value, grad, m, v   float32 blocks of the same length; every quad is updated, so padding between
///              parameters must be finite; with gradient 0 and moments 0 it does not change
/// Errors       kShape for lengths that differ; the recorder's beyond the device's
///              binding limits; nothing is recorded on error
/// Precision    a few roundings of the step, one of the value (tests/ops/adam_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Kingma & Ba 2015, arXiv:1412.6980, algorithm 1
Status adam(vk::Recorder& recorder, const AdamScalars& scalars, const vk::BufferView& value,
            const vk::BufferView& grad, const vk::BufferView& m, const vk::BufferView& v);

/// Where step_decision() reads and writes.
struct StepDecision {
    vk::BufferView
        partial;  ///< results of tensor_stats, one after another; chunks of zeros count as gradients of zero
    vk::BufferView notes;  ///< what to keep of a step
    std::uint64_t checked =
        0;  ///< bytes of the notes, from the first on, that hold blocks of float32
    std::uint64_t block = 16;     ///< bytes of one
    std::uint64_t unchecked = 0;  ///< first bytes of a block, which need not be finite
    vk::BufferView inputs;        ///< a quad (row, bits of a loss, 0, 0), then the table of scalars
    std::uint32_t rules =
        1;  ///< number of Adam's rules; an entry of the table has 32 bytes for each, then 16 for ema()
    vk::BufferView history;    ///< rows of a quad and the notes
    vk::BufferView scalars;    ///< scalars of this step: those of adam() by rule first,
    std::uint64_t ema_at = 0;  ///< first byte of those of ema()
};

/// Decide whether a step updates the parameters: not if a number of the gradients, of the checked notes or the loss is
/// NaN or infinite. Writes a row of the history, (1 if skipped, updates of the rows up to it, numbers of gradients that
/// are not finite modulo 2^32, 1 if all are zero) and the notes, and the scalars of the step: the entry of the table
/// that has the number of the updates of the rows before it.
///
/// Errors       the recorder's
/// Precision    exact
/// Determinism  bit-exact for any thread count
Status step_decision(vk::Recorder& recorder, const StepDecision& views);

}  // namespace splat::ops
