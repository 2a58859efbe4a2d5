"""What the Rust binding takes of the description."""

# Type and prefix of the values of each set of flags, where they do not follow from its name.
FLAGS = {
    "splat_feature_flags": ("Features", "SPLAT_FEATURE_"),
    "splat_picture_warning_flags": ("PictureWarnings", "SPLAT_PICTURE_"),
    "splat_gradient_flags": ("GradientsFlags", "SPLAT_GRADIENTS_"),
}

# Structs that the library fills and the safe crate copies: texts become String, dims a Vec.
OUTPUTS = [
    "splat_device_info", "splat_memory_info", "splat_tensor_info", "splat_tensor_stats",
    "splat_scene_info", "splat_rasterizer_info", "splat_image_info", "splat_image_scores",
    "splat_weights_info", "splat_port", "splat_model_info", "splat_picture_info",
    "splat_predictor_info", "splat_optimizer_info", "splat_trainer_info", "splat_evaluator_info",
    "splat_scores", "splat_ledger", "splat_object_scores", "splat_evaluation_summary",
    "splat_comparison_info", "splat_metric_comparison", "splat_depth_scores",
    "splat_normal_scores", "splat_plane_scores", "splat_mask_scores", "splat_fidelity_scores",
    "splat_point_scores", "splat_prior_model_info", "splat_co3d_info", "splat_tokens_info",
    "splat_mesh_info",
]
# Structs without pointers that the library reads.
INPUTS = ["splat_scene_file_desc", "splat_orbit_desc", "splat_camera_file_desc",
          "splat_rasterizer_desc", "splat_scene_render_desc", "splat_mesh_file_desc",
          "splat_mesh_render_desc"]
# Frozen structs without pointers that are passed in arrays or by address.
SHARED = ["splat_camera", "splat_similarity"]
