// The frozen layouts of scores of priors.
#pragma once

#include "api/layout/layout.h"

namespace splat::test {

inline const Layout kDepthScores = {  // clang-format off
    "splat_depth_scores",
    sizeof(splat_depth_scores),
    80,
    {
    SPLAT_FIELD(splat_depth_scores, struct_size, 0, 4),
    SPLAT_FIELD(splat_depth_scores, reserved, 4, 4),
    SPLAT_FIELD(splat_depth_scores, pixels, 8, 8),
    SPLAT_FIELD(splat_depth_scores, abs_rel, 16, 8),
    SPLAT_FIELD(splat_depth_scores, rmse, 24, 8),
    SPLAT_FIELD(splat_depth_scores, si_rmse, 32, 8),
    SPLAT_FIELD(splat_depth_scores, within, 40, 24),
    SPLAT_FIELD(splat_depth_scores, scale, 64, 8),
    SPLAT_FIELD(splat_depth_scores, shift, 72, 8),}
};  // clang-format on

inline const Layout kNormalScores = {  // clang-format off
    "splat_normal_scores",
    sizeof(splat_normal_scores),
    72,
    {
    SPLAT_FIELD(splat_normal_scores, struct_size, 0, 4),
    SPLAT_FIELD(splat_normal_scores, reserved, 4, 4),
    SPLAT_FIELD(splat_normal_scores, pixels, 8, 8),
    SPLAT_FIELD(splat_normal_scores, missing, 16, 8),
    SPLAT_FIELD(splat_normal_scores, mean, 24, 8),
    SPLAT_FIELD(splat_normal_scores, median, 32, 8),
    SPLAT_FIELD(splat_normal_scores, rmse, 40, 8),
    SPLAT_FIELD(splat_normal_scores, within, 48, 24),}
};  // clang-format on

inline const Layout kMaskScores = {  // clang-format off
    "splat_mask_scores",
    sizeof(splat_mask_scores),
    64,
    {
    SPLAT_FIELD(splat_mask_scores, struct_size, 0, 4),
    SPLAT_FIELD(splat_mask_scores, reserved, 4, 4),
    SPLAT_FIELD(splat_mask_scores, predicted_pixels, 8, 8),
    SPLAT_FIELD(splat_mask_scores, true_pixels, 16, 8),
    SPLAT_FIELD(splat_mask_scores, mae, 24, 8),
    SPLAT_FIELD(splat_mask_scores, iou, 32, 8),
    SPLAT_FIELD(splat_mask_scores, precision, 40, 8),
    SPLAT_FIELD(splat_mask_scores, recall, 48, 8),
    SPLAT_FIELD(splat_mask_scores, f_beta, 56, 8),}
};  // clang-format on

inline const Layout kFidelityScores = {  // clang-format off
    "splat_fidelity_scores",
    sizeof(splat_fidelity_scores),
    48,
    {
    SPLAT_FIELD(splat_fidelity_scores, struct_size, 0, 4),
    SPLAT_FIELD(splat_fidelity_scores, constant_channels, 4, 4),
    SPLAT_FIELD(splat_fidelity_scores, vif, 8, 8),
    SPLAT_FIELD(splat_fidelity_scores, channels, 16, 32),}
};  // clang-format on

inline const Layout kPointScores = {  // clang-format off
    "splat_point_scores",
    sizeof(splat_point_scores),
    72,
    {
    SPLAT_FIELD(splat_point_scores, struct_size, 0, 4),
    SPLAT_FIELD(splat_point_scores, reserved, 4, 4),
    SPLAT_FIELD(splat_point_scores, gaussians, 8, 8),
    SPLAT_FIELD(splat_point_scores, accuracy, 16, 8),
    SPLAT_FIELD(splat_point_scores, completeness, 24, 8),
    SPLAT_FIELD(splat_point_scores, chamfer, 32, 8),
    SPLAT_FIELD(splat_point_scores, chamfer_squared, 40, 8),
    SPLAT_FIELD(splat_point_scores, precision, 48, 8),
    SPLAT_FIELD(splat_point_scores, recall, 56, 8),
    SPLAT_FIELD(splat_point_scores, f_score, 64, 8),}
};  // clang-format on

}  // namespace splat::test
