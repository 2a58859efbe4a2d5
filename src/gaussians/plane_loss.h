#pragma once

#include "gaussians/gaussian_set.h"

namespace splat::gaussians {

/// Which Gaussians of a set lie on which plane, each on one at most.
struct PlaneViews {
    vk::BufferView members;  ///< uint: numbers of Gaussians, plane after plane
    vk::BufferView
        begins;  ///< [planes + 1] uint: the first member of each plane; one may have none
    vk::BufferView normals;  ///< [planes] quads: unit normals in the set's axes, 0
    vk::BufferView offsets;  ///< [planes]: what the forward pass finds for the backward pass
    vk::BufferView partial;  ///< [planes]: of the forward pass alone
    std::uint32_t planes = 0;
    std::uint32_t gaussians = 0;  ///< N, those of the scene, on planes or not
};

/// Mean squared distance of Gaussians from the middle of their plane along its normal, and their own variance along it:
///
///   loss = 1 / N sum over planes p and their Gaussians i of (n_p . mean_i - o_p)^2 + n_p^T Sigma_i n_p
///
/// o_p: mean of n_p . mean_i. The first part holds Gaussians on one plane, wherever it is along its normal, the second
/// makes them flat. Rotations count as they lie in the set, as in the rasterizer.
///
/// loss         [1], the square of the scene's unit
/// Errors       the recorder's
/// Precision    a tree of sums in float32; the deviations are as exact as the means
/// Determinism  bit-exact for any thread count
/// Source       flatness: Chen et al. 2024, "PGSR", arXiv:2406.06521; here across a plane that is known
Status plane_loss_forward(vk::Recorder& recorder, const SetViews& set, const PlaneViews& planes,
                          const vk::BufferView& loss);

/// Add the gradient to that of the set's means, scales and rotations.
///
/// grad_loss    [1] quad: a factor
/// grad         as `set`; its colours are not used
Status plane_loss_backward(vk::Recorder& recorder, const SetViews& set, const PlaneViews& planes,
                           const vk::BufferView& grad_loss, const SetViews& grad);

}  // namespace splat::gaussians
