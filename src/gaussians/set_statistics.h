#pragma once

#include <span>

#include "gaussians/gaussian_set.h"

namespace splat::gaussians {

/// What of a set is finite and visible.
struct SetStatistics {
    std::uint64_t numbers_not_finite = 0;  ///< NaN or infinite, of all Gaussians
    std::uint64_t not_finite = 0;          ///< Gaussians with such a number: no image shows them
    std::uint64_t faint = 0;               ///< Gaussians of an opacity below 1/255, finite or not
    std::uint64_t invisible = 0;           ///< faint and finite ones
};

/// Bytes of `partial` for this many Gaussians.
std::uint64_t set_statistics_bytes(std::uint32_t gaussians);

/// Count a set: chunks on the device, then set_statistics_sum on the host.
///
/// partial      out, set_statistics_bytes
/// Errors       the recorder's
/// Precision    exact
Status set_statistics(vk::Recorder& recorder, const SetDesc& desc, const SetViews& set,
                      const vk::BufferView& partial);

SetStatistics set_statistics_sum(std::span<const std::uint32_t> partial);

}  // namespace splat::gaussians
