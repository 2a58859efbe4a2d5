#pragma once

#include "vision/moge_sizes.h"

namespace splat::vision {

/// Values of MoGe-2's graph, of a picture of rows * columns patches. Level l has rows * 2^l by columns * 2^l pixels.
struct MogeValues {
    VitValues encoder;
    std::vector<nn::ValueId>
        views;  ///< by level, input [1,2,...]: where each pixel lies, see view_plane()
    std::vector<nn::ValueId>
        heads;  ///< in the order of MogeSizes::heads, [1,out,...] of the last level
    nn::ValueId scale = nn::kNoValue;  ///< [1,1,1,1], logarithm of the metric scale
};

/// The network up to the heads' results, which are neither resampled nor remapped:
///
///   neck     x_0 = in_0(features, view_0);   x_l = blocks_l(up(x_(l-1)) + in_l(view_l))
///   heads    the same on the levels of the neck, then out(x_last)
///   block    x + conv(relu(norm(conv(relu(norm x)))));   3x3 convolutions repeat the border
///   scale    an MLP with ReLU of the class token
///
/// Source  Wang et al. 2025, arXiv:2507.02546
MogeValues add_moge(Layers& layers, const MogeSizes& sizes, std::uint32_t rows,
                    std::uint32_t columns);

/// [2,height,width], in halves of the picture's diagonal: x from -sx (w-1)/w to sx (w-1)/w, y in the same way with sy;
/// sx = a / sqrt(1 + a^2), sy = 1 / sqrt(1 + a^2), a the picture's width over its height.
std::vector<float> view_plane(std::uint32_t width, std::uint32_t height, double aspect);

}  // namespace splat::vision
