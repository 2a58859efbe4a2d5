#pragma once

#include <vector>

#include "core/checked_math.h"
#include "params/linear_params.h"
#include "vk/device.h"
#include "vk/pipeline.h"

/// Tiles of the kernels for GPUs: in registers, by what compilers hold there; in shared memory, by the shape.
namespace splat::ops {

struct GpuTiles {
    std::uint32_t weight_quads;    ///< quads of output channels: the direct gradient of a weight
    std::uint32_t winograd_quads;  ///< quads of channels, by 36 places: transforms of inputs
};

/// NVIDIA's driver keeps the tiles that were measured (docs/gpu-h200.md). All others take at most 64 sums, which no
/// compiler of `tools/bench/devices --null` spills, while the larger ones take up to 900 spills on Adreno, 520 on
/// Apple's GPUs and 39 on RDNA (docs/devices.md). The order of sums is the same.
inline GpuTiles gpu_tiles(const vk::DeviceInfo& device) {
    return device.driver_id == VK_DRIVER_ID_NVIDIA_PROPRIETARY ? GpuTiles{8, 2} : GpuTiles{2, 1};
}

/// A GPU of 132 multiprocessors is full with four workgroups of 64 invocations on each, or two of 256.
constexpr std::uint64_t kProductGroups = 528;

/// The tiles of shaders/include/products/product.glsl for a product of m by n results.
struct ProductTiles {
    std::uint32_t side;
    std::uint32_t threads;
    std::uint32_t m;  ///< tiles along m ...
    std::uint32_t n;  ///< ... and n

    [[nodiscard]] std::vector<vk::SpecConstant> constants() const {
        return {{params::kWorkgroupSizeId, threads}, {params::kProductTileId, side}};
    }
};

inline std::uint64_t product_groups(std::uint64_t m, std::uint64_t n, std::uint64_t side) {
    return ceil_div(m, side) * ceil_div(n, side);
}

/// `batches` are all other workgroups: products and slices of their sums. Tiles of 128 load each operand half as often;
/// they are taken if they fill the GPU, compute at most an eighth more results beyond the edges, and the device has
/// their 18 KiB of shared memory. Fewer workgroups than fill it share the sum of each among twice the invocations
/// (`split`). The order of sums depends on the shape alone.
inline ProductTiles product_tiles(const vk::DeviceInfo& device, std::uint64_t m, std::uint64_t n,
                                  std::uint64_t batches, bool split) {
    constexpr std::uint64_t kLarge = 128, kSmall = 64;
    const std::uint64_t large = product_groups(m, n, kLarge), small = product_groups(m, n, kSmall);
    const bool fits = 2 * large * batches >= kProductGroups && 32 * large <= 9 * small &&
                      device.limits.shared_memory_bytes >= kLarge * 9 * 16;
    const std::uint64_t side = fits ? kLarge : kSmall;
    const bool parts = split && small * batches < kProductGroups;
    const auto count = [&](std::uint64_t extent) {
        return static_cast<std::uint32_t>(ceil_div(extent, side));
    };
    return {static_cast<std::uint32_t>(side),
            static_cast<std::uint32_t>(side * side / 64 * (parts ? 2 : 1)), count(m), count(n)};
}

}  // namespace splat::ops
