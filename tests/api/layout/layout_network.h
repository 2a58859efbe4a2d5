// The frozen layouts of weights, models, training and data.
#pragma once

#include "api/layout/layout.h"

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
    136,
    {
    SPLAT_FIELD(splat_model_input, struct_size, 0, 4),
    SPLAT_FIELD(splat_model_input, flags, 4, 4),
    SPLAT_FIELD(splat_model_input, seed, 8, 8),
    SPLAT_FIELD(splat_model_input, step, 16, 4),
    SPLAT_FIELD(splat_model_input, channels, 20, 4),
    SPLAT_FIELD(splat_model_input, objects, 24, 4),
    SPLAT_FIELD(splat_model_input, picture_count, 28, 4),
    SPLAT_FIELD(splat_model_input, pictures, 32, 8),
    SPLAT_FIELD(splat_model_input, images, 40, 8),
    SPLAT_FIELD(splat_model_input, images_count, 48, 8),
    SPLAT_FIELD(splat_model_input, view_to_world, 56, 8),
    SPLAT_FIELD(splat_model_input, view_to_world_count, 64, 8),
    SPLAT_FIELD(splat_model_input, quaternions, 72, 8),
    SPLAT_FIELD(splat_model_input, quaternions_count, 80, 8),
    SPLAT_FIELD(splat_model_input, focals, 88, 8),
    SPLAT_FIELD(splat_model_input, focals_count, 96, 8),
    SPLAT_FIELD(splat_model_input, embedding, 104, 8),
    SPLAT_FIELD(splat_model_input, embedding_count, 112, 8),
    SPLAT_FIELD(splat_model_input, tokens, 120, 8),
    SPLAT_FIELD(splat_model_input, tokens_count, 128, 8),}
};  // clang-format on

inline const Layout kModelGradients = {  // clang-format off
    "splat_model_gradients",
    sizeof(splat_model_gradients),
    88,
    {
    SPLAT_FIELD(splat_model_gradients, struct_size, 0, 4),
    SPLAT_FIELD(splat_model_gradients, flags, 4, 4),
    SPLAT_FIELD(splat_model_gradients, means, 8, 8),
    SPLAT_FIELD(splat_model_gradients, means_count, 16, 8),
    SPLAT_FIELD(splat_model_gradients, opacities, 24, 8),
    SPLAT_FIELD(splat_model_gradients, opacities_count, 32, 8),
    SPLAT_FIELD(splat_model_gradients, scales, 40, 8),
    SPLAT_FIELD(splat_model_gradients, scales_count, 48, 8),
    SPLAT_FIELD(splat_model_gradients, rotations, 56, 8),
    SPLAT_FIELD(splat_model_gradients, rotations_count, 64, 8),
    SPLAT_FIELD(splat_model_gradients, sh, 72, 8),
    SPLAT_FIELD(splat_model_gradients, sh_count, 80, 8),}
};  // clang-format on

inline const Layout kModelInfo = {  // clang-format off
    "splat_model_info",
    sizeof(splat_model_info),
    104,
    {
    SPLAT_FIELD(splat_model_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_model_info, flags, 4, 4),
    SPLAT_FIELD(splat_model_info, objects, 8, 4),
    SPLAT_FIELD(splat_model_info, views, 12, 4),
    SPLAT_FIELD(splat_model_info, resolution, 16, 4),
    SPLAT_FIELD(splat_model_info, channels, 20, 4),
    SPLAT_FIELD(splat_model_info, image_channels, 24, 4),
    SPLAT_FIELD(splat_model_info, output_channels, 28, 4),
    SPLAT_FIELD(splat_model_info, gaussians, 32, 4),
    SPLAT_FIELD(splat_model_info, sh_degree, 36, 4),
    SPLAT_FIELD(splat_model_info, embedding_length, 40, 4),
    SPLAT_FIELD(splat_model_info, token_dim, 44, 4),
    SPLAT_FIELD(splat_model_info, tokens, 48, 4),
    SPLAT_FIELD(splat_model_info, slices, 52, 4),
    SPLAT_FIELD(splat_model_info, fov, 56, 4),
    SPLAT_FIELD(splat_model_info, reserved, 60, 4),
    SPLAT_FIELD(splat_model_info, parameters, 64, 8),
    SPLAT_FIELD(splat_model_info, trainable, 72, 8),
    SPLAT_FIELD(splat_model_info, predicted, 80, 8),
    SPLAT_FIELD(splat_model_info, non_finite, 88, 8),
    SPLAT_FIELD(splat_model_info, faint, 96, 8),}
};  // clang-format on

inline const Layout kPort = {  // clang-format off
    "splat_port",
    sizeof(splat_port),
    80,
    {
    SPLAT_FIELD(splat_port, name, 0, 8),
    SPLAT_FIELD(splat_port, rank, 8, 4),
    SPLAT_FIELD(splat_port, flags, 12, 4),
    SPLAT_FIELD(splat_port, dims, 16, 64),}
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
    144,
    {
    SPLAT_FIELD(splat_trainer_batch, struct_size, 0, 4),
    SPLAT_FIELD(splat_trainer_batch, reserved, 4, 4),
    SPLAT_FIELD(splat_trainer_batch, images, 8, 8),
    SPLAT_FIELD(splat_trainer_batch, images_count, 16, 8),
    SPLAT_FIELD(splat_trainer_batch, view_to_world, 24, 8),
    SPLAT_FIELD(splat_trainer_batch, view_to_world_count, 32, 8),
    SPLAT_FIELD(splat_trainer_batch, quaternions, 40, 8),
    SPLAT_FIELD(splat_trainer_batch, quaternions_count, 48, 8),
    SPLAT_FIELD(splat_trainer_batch, focals, 56, 8),
    SPLAT_FIELD(splat_trainer_batch, focals_count, 64, 8),
    SPLAT_FIELD(splat_trainer_batch, embedding, 72, 8),
    SPLAT_FIELD(splat_trainer_batch, embedding_count, 80, 8),
    SPLAT_FIELD(splat_trainer_batch, tokens, 88, 8),
    SPLAT_FIELD(splat_trainer_batch, tokens_count, 96, 8),
    SPLAT_FIELD(splat_trainer_batch, targets, 104, 8),
    SPLAT_FIELD(splat_trainer_batch, targets_count, 112, 8),
    SPLAT_FIELD(splat_trainer_batch, cameras, 120, 8),
    SPLAT_FIELD(splat_trainer_batch, cameras_count, 128, 8),
    SPLAT_FIELD(splat_trainer_batch, channels, 136, 4),
    SPLAT_FIELD(splat_trainer_batch, objects, 140, 4),}
};  // clang-format on

inline const Layout kTrainerInfo = {  // clang-format off
    "splat_trainer_info",
    sizeof(splat_trainer_info),
    136,
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
    SPLAT_FIELD(splat_trainer_info, update_ms, 72, 8),
    SPLAT_FIELD(splat_trainer_info, lpips, 80, 8),
    SPLAT_FIELD(splat_trainer_info, visible, 88, 8),
    SPLAT_FIELD(splat_trainer_info, culled, 96, 8),
    SPLAT_FIELD(splat_trainer_info, non_finite, 104, 8),
    SPLAT_FIELD(splat_trainer_info, gradients_zero, 112, 4),
    SPLAT_FIELD(splat_trainer_info, reserved, 116, 4),
    SPLAT_FIELD(splat_trainer_info, rate, 120, 8),
    SPLAT_FIELD(splat_trainer_info, edge_loss, 128, 8),}
};  // clang-format on

inline const Layout kModuleDesc = {  // clang-format off
    "splat_module_desc",
    sizeof(splat_module_desc),
    48,
    {
    SPLAT_FIELD(splat_module_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_module_desc, flags, 4, 4),
    SPLAT_FIELD(splat_module_desc, next, 8, 8),
    SPLAT_FIELD(splat_module_desc, type, 16, 8),
    SPLAT_FIELD(splat_module_desc, attributes, 24, 8),
    SPLAT_FIELD(splat_module_desc, ports, 32, 8),
    SPLAT_FIELD(splat_module_desc, port_count, 40, 4),
    SPLAT_FIELD(splat_module_desc, precision, 44, 4),}
};  // clang-format on

inline const Layout kLpipsDesc = {  // clang-format off
    "splat_lpips_desc",
    sizeof(splat_lpips_desc),
    32,
    {
    SPLAT_FIELD(splat_lpips_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_lpips_desc, flags, 4, 4),
    SPLAT_FIELD(splat_lpips_desc, next, 8, 8),
    SPLAT_FIELD(splat_lpips_desc, weights, 16, 8),
    SPLAT_FIELD(splat_lpips_desc, weight_count, 24, 4),
    SPLAT_FIELD(splat_lpips_desc, side, 28, 4),}
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

inline const Layout kDatasetDesc = {  // clang-format off
    "splat_dataset_desc",
    sizeof(splat_dataset_desc),
    104,
    {
    SPLAT_FIELD(splat_dataset_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_dataset_desc, flags, 4, 4),
    SPLAT_FIELD(splat_dataset_desc, next, 8, 8),
    SPLAT_FIELD(splat_dataset_desc, path, 16, 8),
    SPLAT_FIELD(splat_dataset_desc, format, 24, 8),
    SPLAT_FIELD(splat_dataset_desc, split, 32, 8),
    SPLAT_FIELD(splat_dataset_desc, resolution, 40, 4),
    SPLAT_FIELD(splat_dataset_desc, limit, 44, 4),
    SPLAT_FIELD(splat_dataset_desc, cache_bytes, 48, 8),
    SPLAT_FIELD(splat_dataset_desc, background, 56, 12),
    SPLAT_FIELD(splat_dataset_desc, reserved, 68, 4),
    SPLAT_FIELD(splat_dataset_desc, category, 72, 8),
    SPLAT_FIELD(splat_dataset_desc, objects_file, 80, 8),
    SPLAT_FIELD(splat_dataset_desc, excluded_file, 88, 8),
    SPLAT_FIELD(splat_dataset_desc, views_file, 96, 8),}
};  // clang-format on

inline const Layout kDatasetImport = {  // clang-format off
    "splat_dataset_import_desc",
    sizeof(splat_dataset_import_desc),
    56,
    {
    SPLAT_FIELD(splat_dataset_import_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_dataset_import_desc, flags, 4, 4),
    SPLAT_FIELD(splat_dataset_import_desc, next, 8, 8),
    SPLAT_FIELD(splat_dataset_import_desc, path, 16, 8),
    SPLAT_FIELD(splat_dataset_import_desc, out, 24, 8),
    SPLAT_FIELD(splat_dataset_import_desc, split, 32, 8),
    SPLAT_FIELD(splat_dataset_import_desc, duckdb, 40, 8),
    SPLAT_FIELD(splat_dataset_import_desc, shards, 48, 4),
    SPLAT_FIELD(splat_dataset_import_desc, shard, 52, 4),}
};  // clang-format on

inline const Layout kDatasetExport = {  // clang-format off
    "splat_dataset_export_desc",
    sizeof(splat_dataset_export_desc),
    80,
    {
    SPLAT_FIELD(splat_dataset_export_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_dataset_export_desc, flags, 4, 4),
    SPLAT_FIELD(splat_dataset_export_desc, next, 8, 8),
    SPLAT_FIELD(splat_dataset_export_desc, path, 16, 8),
    SPLAT_FIELD(splat_dataset_export_desc, layout, 24, 8),
    SPLAT_FIELD(splat_dataset_export_desc, split, 32, 8),
    SPLAT_FIELD(splat_dataset_export_desc, category, 40, 8),
    SPLAT_FIELD(splat_dataset_export_desc, duckdb, 48, 8),
    SPLAT_FIELD(splat_dataset_export_desc, objects, 56, 8),
    SPLAT_FIELD(splat_dataset_export_desc, object_count, 64, 8),
    SPLAT_FIELD(splat_dataset_export_desc, shards, 72, 4),
    SPLAT_FIELD(splat_dataset_export_desc, shard, 76, 4),}
};  // clang-format on

inline const Layout kDatasetViews = {  // clang-format off
    "splat_dataset_views",
    sizeof(splat_dataset_views),
    136,
    {
    SPLAT_FIELD(splat_dataset_views, struct_size, 0, 4),
    SPLAT_FIELD(splat_dataset_views, reserved, 4, 4),
    SPLAT_FIELD(splat_dataset_views, images, 8, 8),
    SPLAT_FIELD(splat_dataset_views, depths, 16, 8),
    SPLAT_FIELD(splat_dataset_views, normals, 24, 8),
    SPLAT_FIELD(splat_dataset_views, masks, 32, 8),
    SPLAT_FIELD(splat_dataset_views, view_to_world, 40, 8),
    SPLAT_FIELD(splat_dataset_views, quaternions, 48, 8),
    SPLAT_FIELD(splat_dataset_views, focals, 56, 8),
    SPLAT_FIELD(splat_dataset_views, origin_distances, 64, 8),
    SPLAT_FIELD(splat_dataset_views, image_count, 72, 8),
    SPLAT_FIELD(splat_dataset_views, depth_count, 80, 8),
    SPLAT_FIELD(splat_dataset_views, normal_count, 88, 8),
    SPLAT_FIELD(splat_dataset_views, mask_count, 96, 8),
    SPLAT_FIELD(splat_dataset_views, view_to_world_count, 104, 8),
    SPLAT_FIELD(splat_dataset_views, quaternion_count, 112, 8),
    SPLAT_FIELD(splat_dataset_views, focal_count, 120, 8),
    SPLAT_FIELD(splat_dataset_views, origin_distance_count, 128, 8),}
};  // clang-format on

inline const Layout kCo3dDesc = {  // clang-format off
    "splat_co3d_desc",
    sizeof(splat_co3d_desc),
    64,
    {
    SPLAT_FIELD(splat_co3d_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_co3d_desc, flags, 4, 4),
    SPLAT_FIELD(splat_co3d_desc, next, 8, 8),
    SPLAT_FIELD(splat_co3d_desc, raw, 16, 8),
    SPLAT_FIELD(splat_co3d_desc, out, 24, 8),
    SPLAT_FIELD(splat_co3d_desc, category, 32, 8),
    SPLAT_FIELD(splat_co3d_desc, subset, 40, 8),
    SPLAT_FIELD(splat_co3d_desc, split, 48, 8),
    SPLAT_FIELD(splat_co3d_desc, size, 56, 4),
    SPLAT_FIELD(splat_co3d_desc, limit, 60, 4),}
};  // clang-format on

inline const Layout kCo3dInfo = {  // clang-format off
    "splat_co3d_info",
    sizeof(splat_co3d_info),
    24,
    {
    SPLAT_FIELD(splat_co3d_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_co3d_info, sequences, 4, 4),
    SPLAT_FIELD(splat_co3d_info, kept, 8, 4),
    SPLAT_FIELD(splat_co3d_info, left_out, 12, 4),
    SPLAT_FIELD(splat_co3d_info, frames, 16, 8),}
};  // clang-format on

inline const Layout kSyntheticDesc = {  // clang-format off
    "splat_synthetic_desc",
    sizeof(splat_synthetic_desc),
    64,
    {
    SPLAT_FIELD(splat_synthetic_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_synthetic_desc, flags, 4, 4),
    SPLAT_FIELD(splat_synthetic_desc, next, 8, 8),
    SPLAT_FIELD(splat_synthetic_desc, path, 16, 8),
    SPLAT_FIELD(splat_synthetic_desc, category, 24, 8),
    SPLAT_FIELD(splat_synthetic_desc, seed, 32, 8),
    SPLAT_FIELD(splat_synthetic_desc, resolution, 40, 4),
    SPLAT_FIELD(splat_synthetic_desc, train_views, 44, 4),
    SPLAT_FIELD(splat_synthetic_desc, test_views, 48, 4),
    SPLAT_FIELD(splat_synthetic_desc, train_objects, 52, 4),
    SPLAT_FIELD(splat_synthetic_desc, val_objects, 56, 4),
    SPLAT_FIELD(splat_synthetic_desc, test_objects, 60, 4),}
};  // clang-format on

}  // namespace splat::test
