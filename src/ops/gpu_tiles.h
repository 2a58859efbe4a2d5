#pragma once

#include "vk/device.h"

/// Register tiles of the kernels for GPUs, by what compilers hold in registers.
namespace splat::ops {

struct GpuTiles {
    std::uint32_t linear_blocks;      ///< eights of output features, by 4 rows: linear_forward
    std::uint32_t attention_columns;  ///< by 16 rows: attention_product
    std::uint32_t weight_quads;    ///< quads of output channels: weight gradients, but Winograd's
    std::uint32_t winograd_quads;  ///< quads of channels, by 36 places: transforms of inputs
    std::uint32_t winograd_sums;   ///< quads of sums: the product of the gradient of a weight
};

/// NVIDIA's driver keeps the tiles that were measured (docs/gpu-h200.md). All others take at most 64 sums, which no
/// compiler of `tools/bench/devices --null` spills, while the larger ones take up to 900 spills on Adreno, 520 on
/// Apple's GPUs and 39 on RDNA (docs/devices.md). The order of sums is the same.
inline GpuTiles gpu_tiles(const vk::DeviceInfo& device) {
    return device.driver_id == VK_DRIVER_ID_NVIDIA_PROPRIETARY ? GpuTiles{4, 8, 8, 2, 32}
                                                               : GpuTiles{2, 4, 2, 1, 16};
}

}  // namespace splat::ops
