#pragma once

#include <span>

#include "scene/camera.h"
#include "train/render_loss.h"

namespace splat::train {

/// The images of one step, in host memory: B = Trainer::objects() objects with V input views and T target views
/// each, R x R pixels. Cameras are relative to the object's first input view.
struct TrainBatch {
    std::span<const float> images;         ///< [B*V, input channels, R, R]
    std::span<const float> view_to_world;  ///< [B*V, 4, 4] row vectors
    std::span<const float> quaternions;    ///< [B*V, 4] w x y z
    std::span<const float> focals;         ///< [B*V, 2] pixels, or empty
    std::span<const float> embedding;      ///< [B*V, length], or empty
    std::span<const float> tokens;         ///< [B*V, token_dim, tokens], or empty
    std::span<const float> planes;         ///< [B*V, 5, R, R] of data::plane_channels, or empty
    std::span<const float> targets;        ///< [B*T, 3, S, S], S = R, or opt.target_resolution
    std::span<const std::uint8_t> levels;  ///< if not empty, in place of targets: 255 of them is 1
    std::span<const scene::Camera> cameras;  ///< B*T
};

struct TrainStep {
    std::uint64_t step = 0;        ///< updates done
    LossTerms loss;                ///< means over the batch
    bool skipped = false;          ///< loss or gradients were not finite: nothing was updated
    std::uint64_t pairs = 0;       ///< (tile, Gaussian) pairs of all targets
    std::uint64_t visible = 0;     ///< (Gaussian, target) that reach a tile
    std::uint64_t culled = 0;      ///< (Gaussian, target) that do not
    std::uint64_t non_finite = 0;  ///< numbers that the network gave which are NaN or infinite
    bool gradients_zero = false;   ///< gradients of all parameters are zero, to the last bit
    double rate = 0;               ///< learning rate of this update, or of the one that was skipped
    double network_seconds = 0, render_seconds = 0,
           update_seconds = 0;         ///< on this rank, as the following
    std::uint64_t exchange_bytes = 0;  ///< bytes sent to other ranks
    /// Time of exchange that the backward pass does not hide, with the wait for other ranks.
    double exchange_seconds = 0;
};

}  // namespace splat::train
