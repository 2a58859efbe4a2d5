#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

/// Errors: kUnsupported for 2^20 pixels per image or more.
Status feature_distance_check(const QuadDims& dims);

/// Distance between the directions of two images' features, per image:
///
///   y[n] = 1/P sum_p sum_c weight[c] (a / (|a| + eps) - b / (|b| + eps))^2    |.| over the channels
///
/// with eps = 1e-10.
///
/// a, b         [N,C,...] float32 as quads, zero in the channels that pad a quad
/// weight       [C] row-major
/// y            [N,1] as quads
/// Errors       those of feature_distance_check; nothing is recorded on error
/// Precision    the difference of unit vectors cancels: 2^-24 of each, times twice their difference
///              (tests/ops/losses/feature_distance_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Zhang et al. 2018, arXiv:1801.03924, equation 1, with weights outside the square
///
/// The gradient with respect to a, overwritten; 0 at pixels where all of a is 0 and has no direction.
extern const OpRow kFeatureDistanceRow;

}  // namespace splat::ops
