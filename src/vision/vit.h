#pragma once

#include "vision/layers.h"

namespace splat::vision {

struct VitSizes {
    std::uint32_t width = 0;   ///< channels of a token
    std::uint32_t blocks = 0;  ///< at least 1
    std::uint32_t heads = 0;   ///< divides the width into whole quads
    std::uint32_t hidden = 0;  ///< channels between the two layers of a block's MLP
    std::uint32_t patch = 14;  ///< pixels, both ways
    std::uint32_t side = 37;   ///< the table of positions has side * side
    std::vector<std::uint32_t> taps =
        {};  ///< blocks whose outputs are used, rising; the last one's class token
    std::uint32_t features = 0;  ///< channels of the result
};

/// Values of the encoder, of a picture of rows * columns patches.
struct VitValues {
    nn::ValueId image = nn::kNoValue;      ///< input [1,3,rows*patch,columns*patch], normalised
    nn::ValueId positions = nn::kNoValue;  ///< input [1,width,side,side]
    nn::ValueId first_token =
        nn::kNoValue;                     ///< input [1,width,1,1]: the class token and its position
    nn::ValueId features = nn::kNoValue;  ///< [1,features,rows,columns]
    nn::ValueId class_token = nn::kNoValue;  ///< [1,width,1,1]
};

/// A vision transformer under `name`:
///
///   x = (class token, patches) + positions;   each block:  x += ls1 attention(norm1 x),  x += ls2 mlp(norm2 x)
///   features = sum over taps k of projection_k(norm(x_k)) without its class token
///
/// The table of positions is interpolated bicubically with factors of (rows + 0.1) / side, as DINOv2 does it, and taken
/// as it is for side * side patches. Normalisations have an epsilon of 1e-6.
///
/// Source  Oquab et al. 2023, arXiv:2304.07193; Wang et al. 2025, arXiv:2507.02546 (the projections)
VitValues add_vit(Layers& layers, const std::string& name, const VitSizes& sizes,
                  std::uint32_t rows, std::uint32_t columns);

}  // namespace splat::vision
