#pragma once

#include "ops/conv2d.h"
#include "params/conv2d_winograd_params.h"

/// Slices of the tiles of a Winograd convolution, and code shared by its stages.
namespace splat::ops {

/// The specialisation constant of the transforms.
inline vk::SpecConstant winograd_tile(const Conv2dDesc& desc) {
    return {params::kWinogradTileId, static_cast<std::uint32_t>(desc.winograd)};
}

/// A slice is a whole number of workgroups of the product, so that none of the stages has to guard
/// the tiles it reads.
struct WinogradSlices {
    std::uint32_t all;      ///< tiles of the batch
    std::uint32_t tiles;    ///< tiles of a slice; the last may have fewer
    std::uint32_t lanes;    ///< workgroup size
    std::uint32_t columns;  ///< register tile of the product: tiles of each lane ...
    std::uint32_t blocks;   ///< ... by 8 * blocks output channels
    std::uint32_t depth;    ///< quads of input channels per turn of its loop

    /// Workgroups of the transforms for `count` tiles: a multiple of `columns`.
    [[nodiscard]] std::uint32_t groups(std::uint32_t count) const;

    /// A transformed tensor of one slice.
    [[nodiscard]] std::uint64_t bytes(const Conv2dDesc& desc, std::uint32_t channels) const;
};

/// Constants of the transforms of inputs, and the workgroups along the channels: octets, or quads for GPUs with few
/// registers.
std::vector<vk::SpecConstant> winograd_transform(const vk::Recorder& recorder,
                                                 const Conv2dDesc& desc,
                                                 const WinogradSlices& slices);
std::uint32_t winograd_parts(const vk::Recorder& recorder, std::uint32_t channels);

/// (desc.winograd + 2)^2: the places of a transformed tile.
std::uint32_t winograd_places(const Conv2dDesc& desc);

WinogradSlices winograd_slices(const vk::Recorder& recorder, const Conv2dDesc& desc);

params::Conv2dWinogradParams winograd_params(const Conv2dDesc& desc);

/// V = B^T x B of one slice.
Status winograd_input(vk::Recorder& recorder, const char* op, const Conv2dDesc& desc,
                      const WinogradSlices& slices, params::Conv2dWinogradParams params,
                      const vk::BufferView& x, const vk::BufferView& transformed);

}  // namespace splat::ops
