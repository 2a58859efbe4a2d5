#pragma once

#include "ops/conv2d.h"

namespace splat::ops {

/// Rounding error that a network accepts from its convolutions.
enum class Conv2dPrecision : int {
    kStrict,  ///< the fastest with an error like that of the definition: 5e-7
    kBalanced,  ///< F(4x4) except for the smallest images: a cars network's output within 2e-7 (PyTorch: 3e-7)
    kFast,  ///< F(4x4) wherever it is faster: 1e-6 per layer
};

/// Conv2dDesc::winograd for a convolution.
///
/// Errors are relative L2 against float64 for normal inputs; the definition in float32 has 2e-7. Those of
/// each shape: vkrun bench ops --only conv2d.
///
///   class                    strict   balanced   fast     reason
///   1x1                      0        0          0        a transform saves nothing
///   image below 3x3          0        0          0        most of a tile would lie outside
///   <= 8 output channels     0        0          0        by taps: a transform of the input would serve few products
///   image of 32x32 or more   2 (5e-7) 4 (1e-6)   4 (1e-6) nearly all work is here
///   smaller image            2 (5e-7) 2 (5e-7)   4 (1e-6) little to gain; small networks have nothing else
///
/// Other channel counts do not matter: for 3 -> 128 and 128 -> 24 on 128x128, F(4x4) takes a third and a fifth of
/// the direct kernel's time, F(2x2) two thirds (lavapipe).
/// Plain kernels ignore it. Figures of lavapipe: BENCHMARKS.md.
std::int32_t conv2d_algorithm(const Conv2dDesc& desc, Conv2dPrecision precision);

}  // namespace splat::ops
