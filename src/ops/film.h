#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct FilmDesc {
    QuadDims x;
    bool scaled = true;  ///< the modulation is [N,2C], gamma before beta; else [N,C], beta alone
};

/// Errors: kUnsupported beyond the device's group counts.
Status film_check(const vk::DeviceInfo& device, const FilmDesc& desc);

/// Feature-wise linear modulation:  y = gamma[n,c] * x + beta[n,c], or y = x + beta[n,c]
///
/// x, y         [N,C,...] float32 as quads; y may be x
/// modulation   [N,2C] or [N,C] as quads
/// Errors       those of film_check; nothing is recorded on error
/// Precision    two roundings
/// Determinism  bit-exact for any thread count
/// Source       Perez et al. 2017, arXiv:1709.07871, eq. 2
///
/// The gradients:  grad_x = gamma * grad_y,  grad_gamma = sum_p grad_y * x,  grad_beta = sum_p grad_y
///
/// grad_x           as quads, overwritten; may be grad_y
/// grad_modulation  as the modulation, overwritten
/// Precision        grad_modulation 2e-6 relative L2 (tests/ops/film_test.cpp)
/// Errors, Determinism  as the forward pass
/// Source           derived in tests/ref/film_ref.h
extern const OpRow kFilmRow;

}  // namespace splat::ops
