#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct FourierEmbeddingDesc {
    std::uint32_t rows = 1;
    std::uint32_t features = 1;
    std::uint32_t waves = 1;  ///< frequencies; values per feature are twice as many
};

/// Errors: kUnsupported for 2^31 elements.
Status fourier_embedding_check(const FourierEmbeddingDesc& desc);

/// Each feature s becomes 2W values:  cos(2 pi s f_j), j < W, then sin(2 pi s f_j)
///
/// x, y         [rows,F] and [rows,F*2W] float32 as quads; no aliasing
/// frequencies  [W] float32, constant; random in both sources, N(0,1) * 16 in the second
/// Errors       those of fourier_embedding_check; nothing is recorded on error
/// Precision    5e-7 absolute for |s|, |f_j| < 2^60: s f_j is exact, in two floats, and loses its whole
///              turns before it is multiplied by 2 pi
/// Determinism  bit-exact for any thread count
/// Source       Tancik et al. 2020, arXiv:2006.10739; Song et al. 2021, arXiv:2011.13456
///
/// The gradient:  grad_x = sum_j 2 pi f_j (cos(2 pi s f_j) grad_sin_j - sin(2 pi s f_j) grad_cos_j); the
/// rest as in the forward pass.
extern const OpRow kFourierEmbeddingRow;

}  // namespace splat::ops
