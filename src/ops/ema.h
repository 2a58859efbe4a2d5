#pragma once

#include <array>
#include <optional>

#include "params/optimiser_params.h"
#include "vk/recorder.h"

namespace splat::ops {

/// When the exponential moving average of the parameters is updated, and how fast it decays.
struct EmaSchedule {
    std::uint64_t update_every = 10;
    std::uint64_t update_after =
        100;               ///< until this call, and at the first update after it: a copy
    double most = 0.9999;  ///< the decay's limit
    double power = 2.0 / 3.0;
};

/// The decay of a call, counted from 0: nothing if the average is not updated, 0 for a copy, else
/// min(most, 1 - (1 + call - update_after)^-power).
///
/// Source: the schedule of Splatter Image's training (arXiv:2312.13150) with its package ema-pytorch.
std::optional<double> ema_decay(std::uint64_t call, const EmaSchedule& schedule = {});

/// The quad that ema() reads; without a decay ema() changes nothing. Errors: kInvalidArgument for a decay outside of
/// [0, 1].
Result<std::array<float, 4>> ema_scalars(std::optional<double> decay);

/// Exponential moving average, in place:  shadow -= (shadow - value) (1 - decay)
///
/// value, shadow   float32 blocks of the same length; every quad is updated
/// scalars      those of ema_scalars; a decay of 0 is an exact copy
/// Errors       kShape for lengths that differ, the recorder's beyond the device's binding limits;
///              nothing is recorded on error
/// Precision    three roundings; 0 copies bits
/// Determinism  bit-exact for any thread count
/// Source       Polyak & Juditsky 1992, doi:10.1137/0330046, with exponential weights
Status ema(vk::Recorder& recorder, const vk::BufferView& scalars, const vk::BufferView& value,
           const vk::BufferView& shadow);

}  // namespace splat::ops
