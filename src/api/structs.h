#pragma once

#include <cstddef>

#include "splat.h"

// All structs of the headers, in the order of splat_build_info.
// clang-format off
#define SPLAT_STRUCTS(X) \
    X(splat_camera) X(splat_camera_bytes) X(splat_camera_file_desc) X(splat_co3d_desc) \
    X(splat_co3d_info) X(splat_compare_desc) X(splat_comparison_info) X(splat_dataset_desc) \
    X(splat_dataset_export_desc) X(splat_dataset_import_desc) X(splat_dataset_views) \
    X(splat_decode_limits) X(splat_depth_scores) X(splat_device_desc) X(splat_device_info) \
    X(splat_evaluated_views) X(splat_evaluation_summary) X(splat_evaluator_desc) \
    X(splat_evaluator_info) X(splat_external_memory) \
    X(splat_fidelity_scores) X(splat_fit_desc) X(splat_gaussians_desc) \
    X(splat_gradients_desc) X(splat_group) X(splat_image) X(splat_image_info) X(splat_image_scores) \
    X(splat_ledger) X(splat_lpips_desc) X(splat_mask_scores) X(splat_memory_info) \
    X(splat_mesh_desc) X(splat_mesh_file_desc) X(splat_mesh_info) X(splat_mesh_maps) X(splat_mesh_render_desc) \
    X(splat_mesh_views_desc) \
    X(splat_metric_comparison) X(splat_model_desc) X(splat_model_gradients) X(splat_model_info) \
    X(splat_model_input) X(splat_module_desc) X(splat_named_array) X(splat_normal_scores) \
    X(splat_normals_desc) X(splat_number) X(splat_object_scores) X(splat_op_desc) \
    X(splat_optimizer_desc) X(splat_optimizer_group) X(splat_optimizer_info) X(splat_optimizer_item) \
    X(splat_orbit_desc) X(splat_picture) X(splat_picture_cut_desc) X(splat_picture_info) X(splat_picture_source) \
    X(splat_plane_scores) X(splat_planes_desc) \
    X(splat_point_scores) X(splat_port) X(splat_prediction) X(splat_predictor_desc) \
    X(splat_predictor_info) X(splat_prior_maps) X(splat_prior_model_desc) \
    X(splat_prior_model_info) X(splat_rasterizer_desc) X(splat_rasterizer_info) \
    X(splat_run_event) X(splat_scene_desc) X(splat_scene_file_desc) X(splat_scene_info) \
    X(splat_scene_render_desc) \
    X(splat_score) X(splat_score_set) X(splat_scores) X(splat_similarity) \
    X(splat_synthetic_desc) X(splat_tensor_desc) X(splat_tensor_info) X(splat_tensor_stats) \
    X(splat_tokens_desc) X(splat_tokens_info) \
    X(splat_trainer_batch) X(splat_trainer_desc) X(splat_trainer_info) X(splat_training_desc) \
    X(splat_vulkan_desc) X(splat_vulkan_frame) X(splat_vulkan_requirements) X(splat_vulkan_target) X(splat_weights_info)
// clang-format on

namespace splat::api {

/// A struct's name, which messages begin with.
template <class Struct>
constexpr const char* kStructName = nullptr;
#define SPLAT_STRUCT_NAME(type) \
    template <>                 \
    inline constexpr const char* kStructName<type> = #type;
SPLAT_STRUCTS(SPLAT_STRUCT_NAME)
#undef SPLAT_STRUCT_NAME

/// Bytes of the members of a struct's first version: give a struct that grows its own value here.
template <class Struct>
constexpr std::size_t kFirstVersionBytes = sizeof(Struct);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_device_desc> = offsetof(splat_device_desc,
                                                                              max_submit_ns);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_gaussians_desc> =
    offsetof(splat_gaussians_desc, view_ranges);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_device_info> = offsetof(splat_device_info,
                                                                              kernels_note);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_scene_info> = offsetof(splat_scene_info,
                                                                             bytes);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_metric_comparison> =
    offsetof(splat_metric_comparison, bca_low);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_prior_model_desc> =
    offsetof(splat_prior_model_desc, device);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_training_desc> = offsetof(splat_training_desc,
                                                                                group);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_predictor_desc> =
    offsetof(splat_predictor_desc, aggregate);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_predictor_info> =
    offsetof(splat_predictor_info, whole);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_dataset_views> = offsetof(splat_dataset_views,
                                                                                planes);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_trainer_batch> = offsetof(splat_trainer_batch,
                                                                                planes);
template <>
inline constexpr std::size_t kFirstVersionBytes<splat_trainer_info> = offsetof(splat_trainer_info,
                                                                               plane_loss);

}  // namespace splat::api
