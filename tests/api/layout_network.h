// The frozen layouts of weights, models and training.
#pragma once

#include "api/layout.h"

namespace splat::test {

inline const Layout kWeightsInfo = {  // clang-format off
    "splat_weights_info",
    sizeof(splat_weights_info),
    96,
    {
    SPLAT_FIELD(splat_weights_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_weights_info, rank, 4, 4),
    SPLAT_FIELD(splat_weights_info, dims, 8, 64),
    SPLAT_FIELD(splat_weights_info, elements, 72, 8),
    SPLAT_FIELD(splat_weights_info, name, 80, 8),
    SPLAT_FIELD(splat_weights_info, dtype, 88, 8),}
};  // clang-format on

inline const Layout kModelDesc = {  // clang-format off
    "splat_model_desc",
    sizeof(splat_model_desc),
    32,
    {
    SPLAT_FIELD(splat_model_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_model_desc, flags, 4, 4),
    SPLAT_FIELD(splat_model_desc, next, 8, 8),
    SPLAT_FIELD(splat_model_desc, config, 16, 8),
    SPLAT_FIELD(splat_model_desc, objects, 24, 4),
    SPLAT_FIELD(splat_model_desc, precision, 28, 4),}
};  // clang-format on

inline const Layout kModelInput = {  // clang-format off
    "splat_model_input",
    sizeof(splat_model_input),
    64,
    {
    SPLAT_FIELD(splat_model_input, struct_size, 0, 4),
    SPLAT_FIELD(splat_model_input, step, 4, 4),
    SPLAT_FIELD(splat_model_input, seed, 8, 8),
    SPLAT_FIELD(splat_model_input, images, 16, 8),
    SPLAT_FIELD(splat_model_input, view_to_world, 24, 8),
    SPLAT_FIELD(splat_model_input, quaternions, 32, 8),
    SPLAT_FIELD(splat_model_input, focals, 40, 8),
    SPLAT_FIELD(splat_model_input, embedding, 48, 8),
    SPLAT_FIELD(splat_model_input, tokens, 56, 8),}
};  // clang-format on

inline const Layout kTrainerDesc = {  // clang-format off
    "splat_trainer_desc",
    sizeof(splat_trainer_desc),
    24,
    {
    SPLAT_FIELD(splat_trainer_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_trainer_desc, flags, 4, 4),
    SPLAT_FIELD(splat_trainer_desc, next, 8, 8),
    SPLAT_FIELD(splat_trainer_desc, config, 16, 8),}
};  // clang-format on

inline const Layout kTrainerBatch = {  // clang-format off
    "splat_trainer_batch",
    sizeof(splat_trainer_batch),
    72,
    {
    SPLAT_FIELD(splat_trainer_batch, struct_size, 0, 4),
    SPLAT_FIELD(splat_trainer_batch, reserved, 4, 4),
    SPLAT_FIELD(splat_trainer_batch, images, 8, 8),
    SPLAT_FIELD(splat_trainer_batch, view_to_world, 16, 8),
    SPLAT_FIELD(splat_trainer_batch, quaternions, 24, 8),
    SPLAT_FIELD(splat_trainer_batch, focals, 32, 8),
    SPLAT_FIELD(splat_trainer_batch, embedding, 40, 8),
    SPLAT_FIELD(splat_trainer_batch, tokens, 48, 8),
    SPLAT_FIELD(splat_trainer_batch, targets, 56, 8),
    SPLAT_FIELD(splat_trainer_batch, cameras, 64, 8),}
};  // clang-format on

inline const Layout kTrainerInfo = {  // clang-format off
    "splat_trainer_info",
    sizeof(splat_trainer_info),
    80,
    {
    SPLAT_FIELD(splat_trainer_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_trainer_info, skipped, 4, 4),
    SPLAT_FIELD(splat_trainer_info, step, 8, 8),
    SPLAT_FIELD(splat_trainer_info, pairs, 16, 8),
    SPLAT_FIELD(splat_trainer_info, loss, 24, 8),
    SPLAT_FIELD(splat_trainer_info, squared_error, 32, 8),
    SPLAT_FIELD(splat_trainer_info, pixel_loss, 40, 8),
    SPLAT_FIELD(splat_trainer_info, ssim, 48, 8),
    SPLAT_FIELD(splat_trainer_info, network_ms, 56, 8),
    SPLAT_FIELD(splat_trainer_info, render_ms, 64, 8),
    SPLAT_FIELD(splat_trainer_info, update_ms, 72, 8),}
};  // clang-format on

inline const Layout kImageScores = {  // clang-format off
    "splat_image_scores",
    sizeof(splat_image_scores),
    32,
    {
    SPLAT_FIELD(splat_image_scores, struct_size, 0, 4),
    SPLAT_FIELD(splat_image_scores, reserved, 4, 4),
    SPLAT_FIELD(splat_image_scores, squared_error, 8, 8),
    SPLAT_FIELD(splat_image_scores, psnr, 16, 8),
    SPLAT_FIELD(splat_image_scores, ssim, 24, 8),}
};  // clang-format on

}  // namespace splat::test
