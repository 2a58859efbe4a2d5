// The frozen layouts of pictures and predictions.
#pragma once

#include "api/layout/layout.h"

namespace splat::test {

inline const Layout kPictureSource = {  // clang-format off
    "splat_picture_source",
    sizeof(splat_picture_source),
    64,
    {
    SPLAT_FIELD(splat_picture_source, path, 0, 8),
    SPLAT_FIELD(splat_picture_source, pixels, 8, 56),}
};  // clang-format on

inline const Layout kPicture = {  // clang-format off
    "splat_picture",
    sizeof(splat_picture),
    440,
    {
    SPLAT_FIELD(splat_picture, image, 0, 64),
    SPLAT_FIELD(splat_picture, mask, 64, 64),
    SPLAT_FIELD(splat_picture, depth, 128, 64),
    SPLAT_FIELD(splat_picture, normal, 192, 64),
    SPLAT_FIELD(splat_picture, flags, 256, 4),
    SPLAT_FIELD(splat_picture, foreground, 260, 4),
    SPLAT_FIELD(splat_picture, focal, 264, 8),
    SPLAT_FIELD(splat_picture, origin_distance, 272, 8),
    SPLAT_FIELD(splat_picture, world_to_camera, 280, 128),
    SPLAT_FIELD(splat_picture, embedding, 408, 8),
    SPLAT_FIELD(splat_picture, embedding_count, 416, 8),
    SPLAT_FIELD(splat_picture, tokens, 424, 8),
    SPLAT_FIELD(splat_picture, token_count, 432, 8),}
};  // clang-format on

inline const Layout kPictureInfo = {  // clang-format off
    "splat_picture_info",
    sizeof(splat_picture_info),
    56,
    {
    SPLAT_FIELD(splat_picture_info, width, 0, 4),
    SPLAT_FIELD(splat_picture_info, height, 4, 4),
    SPLAT_FIELD(splat_picture_info, found, 8, 4),
    SPLAT_FIELD(splat_picture_info, warnings, 12, 4),
    SPLAT_FIELD(splat_picture_info, square, 16, 24),
    SPLAT_FIELD(splat_picture_info, focal, 40, 8),
    SPLAT_FIELD(splat_picture_info, fov_degrees, 48, 8),}
};  // clang-format on

inline const Layout kPictureCutDesc = {  // clang-format off
    "splat_picture_cut_desc",
    sizeof(splat_picture_cut_desc),
    256,
    {
    SPLAT_FIELD(splat_picture_cut_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_picture_cut_desc, flags, 4, 4),
    SPLAT_FIELD(splat_picture_cut_desc, next, 8, 8),
    SPLAT_FIELD(splat_picture_cut_desc, resolution, 16, 4),
    SPLAT_FIELD(splat_picture_cut_desc, background, 20, 12),
    SPLAT_FIELD(splat_picture_cut_desc, image, 32, 56),
    SPLAT_FIELD(splat_picture_cut_desc, mask, 88, 56),
    SPLAT_FIELD(splat_picture_cut_desc, depth, 144, 56),
    SPLAT_FIELD(splat_picture_cut_desc, normal, 200, 56),}
};  // clang-format on

inline const Layout kPredictorDesc = {  // clang-format off
    "splat_predictor_desc",
    sizeof(splat_predictor_desc),
    64,
    {
    SPLAT_FIELD(splat_predictor_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_predictor_desc, flags, 4, 4),
    SPLAT_FIELD(splat_predictor_desc, next, 8, 8),
    SPLAT_FIELD(splat_predictor_desc, weights_path, 16, 8),
    SPLAT_FIELD(splat_predictor_desc, weights, 24, 8),
    SPLAT_FIELD(splat_predictor_desc, config, 32, 8),
    SPLAT_FIELD(splat_predictor_desc, adapters_path, 40, 8),
    SPLAT_FIELD(splat_predictor_desc, adapters, 48, 8),
    SPLAT_FIELD(splat_predictor_desc, adapters_alpha, 56, 8),}
};  // clang-format on

inline const Layout kPredictorInfo = {  // clang-format off
    "splat_predictor_info",
    sizeof(splat_predictor_info),
    72,
    {
    SPLAT_FIELD(splat_predictor_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_predictor_info, views, 4, 4),
    SPLAT_FIELD(splat_predictor_info, resolution, 8, 4),
    SPLAT_FIELD(splat_predictor_info, channels, 12, 4),
    SPLAT_FIELD(splat_predictor_info, depth, 16, 4),
    SPLAT_FIELD(splat_predictor_info, normal, 20, 4),
    SPLAT_FIELD(splat_predictor_info, mask, 24, 4),
    SPLAT_FIELD(splat_predictor_info, origin_distance, 28, 4),
    SPLAT_FIELD(splat_predictor_info, gaussians, 32, 8),
    SPLAT_FIELD(splat_predictor_info, sh_degree, 40, 4),
    SPLAT_FIELD(splat_predictor_info, background, 44, 12),
    SPLAT_FIELD(splat_predictor_info, fov_degrees, 56, 8),
    SPLAT_FIELD(splat_predictor_info, category, 64, 8),}
};  // clang-format on

inline const Layout kPrediction = {  // clang-format off
    "splat_prediction",
    sizeof(splat_prediction),
    96,
    {
    SPLAT_FIELD(splat_prediction, struct_size, 0, 4),
    SPLAT_FIELD(splat_prediction, camera_capacity, 4, 4),
    SPLAT_FIELD(splat_prediction, cameras, 8, 8),
    SPLAT_FIELD(splat_prediction, pictures, 16, 8),
    SPLAT_FIELD(splat_prediction, picture_capacity, 24, 4),
    SPLAT_FIELD(splat_prediction, camera_count, 28, 4),
    SPLAT_FIELD(splat_prediction, picture_count, 32, 4),
    SPLAT_FIELD(splat_prediction, reserved, 36, 4),
    SPLAT_FIELD(splat_prediction, inputs, 40, 8),
    SPLAT_FIELD(splat_prediction, input_capacity, 48, 8),
    SPLAT_FIELD(splat_prediction, gaussians, 56, 8),
    SPLAT_FIELD(splat_prediction, not_finite, 64, 8),
    SPLAT_FIELD(splat_prediction, faint, 72, 8),
    SPLAT_FIELD(splat_prediction, read_ms, 80, 8),
    SPLAT_FIELD(splat_prediction, network_ms, 88, 8),}
};  // clang-format on

}  // namespace splat::test
