// The frozen layouts of models of priors and of their maps.
#pragma once

#include "api/layout/layout.h"

namespace splat::test {

inline const Layout kPriorModelDesc = {  // clang-format off
    "splat_prior_model_desc",
    sizeof(splat_prior_model_desc),
    48,
    {
    SPLAT_FIELD(splat_prior_model_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_prior_model_desc, flags, 4, 4),
    SPLAT_FIELD(splat_prior_model_desc, next, 8, 8),
    SPLAT_FIELD(splat_prior_model_desc, preset, 16, 8),
    SPLAT_FIELD(splat_prior_model_desc, model_path, 24, 8),
    SPLAT_FIELD(splat_prior_model_desc, runtime_path, 32, 8),
    SPLAT_FIELD(splat_prior_model_desc, threads, 40, 4),
    SPLAT_FIELD(splat_prior_model_desc, reserved, 44, 4),}
};  // clang-format on

inline const Layout kPriorModelInfo = {  // clang-format off
    "splat_prior_model_info",
    sizeof(splat_prior_model_info),
    56,
    {
    SPLAT_FIELD(splat_prior_model_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_prior_model_info, maps, 4, 4),
    SPLAT_FIELD(splat_prior_model_info, width, 8, 4),
    SPLAT_FIELD(splat_prior_model_info, height, 12, 4),
    SPLAT_FIELD(splat_prior_model_info, preset, 16, 8),
    SPLAT_FIELD(splat_prior_model_info, licence, 24, 8),
    SPLAT_FIELD(splat_prior_model_info, note, 32, 8),
    SPLAT_FIELD(splat_prior_model_info, path, 40, 8),
    SPLAT_FIELD(splat_prior_model_info, runtime_version, 48, 8),}
};  // clang-format on

inline const Layout kPriorMaps = {  // clang-format off
    "splat_prior_maps",
    sizeof(splat_prior_maps),
    168,
    {
    SPLAT_FIELD(splat_prior_maps, depth, 0, 56),
    SPLAT_FIELD(splat_prior_maps, normal, 56, 56),
    SPLAT_FIELD(splat_prior_maps, mask, 112, 56),}
};  // clang-format on

inline const Layout kNormalsDesc = {  // clang-format off
    "splat_normals_desc",
    sizeof(splat_normals_desc),
    64,
    {
    SPLAT_FIELD(splat_normals_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_normals_desc, flags, 4, 4),
    SPLAT_FIELD(splat_normals_desc, next, 8, 8),
    SPLAT_FIELD(splat_normals_desc, focal_x, 16, 8),
    SPLAT_FIELD(splat_normals_desc, focal_y, 24, 8),
    SPLAT_FIELD(splat_normals_desc, center_x, 32, 8),
    SPLAT_FIELD(splat_normals_desc, center_y, 40, 8),
    SPLAT_FIELD(splat_normals_desc, nearest, 48, 8),
    SPLAT_FIELD(splat_normals_desc, farthest, 56, 8),}
};  // clang-format on

}  // namespace splat::test
