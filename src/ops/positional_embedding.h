#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct PositionalEmbeddingDesc {
    std::uint32_t rows = 1;
    std::uint32_t features = 1;
    std::uint32_t dimension = 2;  ///< values per feature
    bool swap_halves = false;     ///< exchange the halves of the result
};

/// Errors: kInvalidArgument for an odd dimension or one beyond 64, or halves that do not exist;
/// kUnsupported for 2^31 elements.
Status positional_embedding_check(const PositionalEmbeddingDesc& desc);

/// Each feature s becomes D values:  cos(s f_j), j < D/2, then sin(s f_j),  f_j = 10000^(-2j/D)
///
/// x, y         [rows,F] and [rows,F*D] float32 as quads; no aliasing
/// Errors       those of positional_embedding_check; nothing is recorded on error
/// Precision    1e-6 absolute for |s| <= 8: s f_j is rounded like any product (f_j a product of j
///              factors), its sine and cosine are within 2^-22
/// Determinism  bit-exact for any thread count
/// Source       Vaswani et al. 2017, arXiv:1706.03762, section 3.5
///
/// The gradient:  grad_x = sum_j f_j (cos(s f_j) grad_sin_j - sin(s f_j) grad_cos_j); the rest as in
/// the forward pass.
extern const OpRow kPositionalEmbeddingRow;

}  // namespace splat::ops
