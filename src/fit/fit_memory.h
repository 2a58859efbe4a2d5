#pragma once

#include <span>
#include <string>

#include "data/posed_photos.h"
#include "fit/fitter.h"

namespace splat::fit {

/// Bytes that a fit takes at its most.
struct FitMemory {
    std::uint64_t photographs = 0;
    std::uint64_t gaussians = 0;  ///< parameters, moments, gradients, and what rearranges them
    std::uint64_t rasterizer = 0;
    std::uint64_t loss = 0;
    std::uint64_t blocks = 0;  ///< unused parts of what the device is asked for
    std::uint64_t host = 0;    ///< reduced photographs, and a state while it is saved

    [[nodiscard]] std::uint64_t device() const {
        return photographs + gaussians + rasterizer + loss + blocks;
    }
};

/// Estimate for up to so many Gaussians and views of 1 / factor of the photographs' sides. Pairs of tiles and
/// Gaussians, which only drawing tells, are those of fits that were measured, and half as many again.
FitMemory fit_memory(const FitCosts& costs, std::span<const data::PosedPhoto> photos,
                     std::uint32_t gaussians, std::uint32_t factor);

/// What a fit has where there is memory for it.
struct MemoryWish {
    std::uint32_t gaussians = 0;
    std::uint32_t least = 0;   ///< Gaussians of a scene to begin with
    std::uint32_t factor = 1;  ///< divides the sides of photographs
};

/// What a fit does to keep to its memory.
struct MemoryPlan {
    std::uint32_t gaussians = 0;  ///< most of them
    std::uint32_t factor = 1;     ///< divides the sides of photographs
    FitMemory needs;
};

/// The most Gaussians, up to those of the wish, with which the fit takes `bytes`, on CPU devices together with the
/// host's part; at a lower resolution where a quarter of them, 5,000, or the least ones, are too many.
///
/// Errors       kOutOfDeviceMemory if these at the least resolution (views of 32 pixels, a factor of 64) take more
/// Determinism  depends on the arguments alone
Result<MemoryPlan> plan_memory(const FitCosts& costs, std::span<const data::PosedPhoto> photos,
                               std::uint64_t bytes, bool is_cpu, const MemoryWish& wish);

/// Bytes that there are for a fit: those of the device's budget that nothing uses; on CPU devices at most those that
/// the host can give.
std::uint64_t memory_left(vk::Context& context);

/// "412 MB".
std::string megabytes(std::uint64_t bytes);

}  // namespace splat::fit
