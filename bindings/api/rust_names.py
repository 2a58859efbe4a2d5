"""What the Rust binding takes of the description, and the words that the headers lack there."""

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
    "splat_normal_scores", "splat_mask_scores", "splat_fidelity_scores", "splat_point_scores",
    "splat_prior_model_info", "splat_co3d_info",
]
# Structs without pointers that the library reads.
INPUTS = ["splat_scene_file_desc", "splat_orbit_desc", "splat_camera_file_desc",
          "splat_rasterizer_desc", "splat_scene_render_desc"]
# Frozen structs without pointers that are passed in arrays or by address.
SHARED = ["splat_camera", "splat_similarity"]

# Numbers that are 0 or 1.
TRUTHS = {
    "splat_device_info.usable", "splat_tensor_info.mapped", "splat_predictor_info.depth",
    "splat_predictor_info.normal", "splat_predictor_info.mask",
    "splat_predictor_info.origin_distance", "splat_optimizer_info.was_skipped",
    "splat_optimizer_info.gradients_zero", "splat_optimizer_info.averaged",
    "splat_trainer_info.skipped", "splat_trainer_info.gradients_zero",
    "splat_object_scores.not_finite", "splat_comparison_info.unpaired",
    "splat_comparison_info.comparable", "splat_metric_comparison.exact",
}

# Documentation of fields that the headers leave to the name, or say with the field before.
FIELDS = {
    "kind": "What kind of device it is.",
    "vendor_id": "Vulkan's number of the vendor.",
    "device_id": "The vendor's number of the device.",
    "uuid": "For `DeviceSelect::BY_UUID`.",
    "max_workgroup_invocations": "Threads of a workgroup, at most.",
    "shared_memory_bytes": "Shared memory of a workgroup.",
    "subgroup_size": "Threads of a subgroup.",
    "splat_device_info.name": "The driver's name of the device.",
    "budget_bytes": "What this device may use, at most.",
    "dtype": "The type of the elements.",
    "dims": "Elements, outermost first.",
    "elements": "The product of `dims`.",
    "bytes": "The size of all elements.",
    "nan_count": "Elements that are NaN.",
    "inf_count": "Elements that are infinite.",
    "sh_degree": "Degree of the spherical harmonics, 0 to 3.",
    "count": "Gaussians.",
    "scale_max": "The largest finite standard deviation, scene units.",
    "scale_mean": "The mean of the finite standard deviations, scene units.",
    "opacity_max": "0 to 1.",
    "opacity_mean": "0 to 1.",
    "ssim": "1 for equal images.",
    "token_dim": "Numbers of a token; 0: none.",
    "trainable": "Numbers of parameters that a training changes.",
    "height": "Pixels.",
    "found": "By what the object was found.",
    "squared_error": "Mean over pixels and channels.",
    "pixel_loss": "The part of `loss` that compares pixels.",
    "network_ms": "Time of the network's passes.",
    "render_ms": "Time of the rasterizer's passes.",
    "update_ms": "Time of the update.",
    "views": "Scored views.",
    "novel": "Scores of the novel views.",
    "conditioning": "Scores of the conditioning views.",
    "ledger": "What became of the Gaussians.",
    "objects": "Scored objects.",
    "empty_views": "Views that are skipped: the target is all black.",
    "images_per_second": "Drawn; NaN for images of the caller.",
    "objects_a": "Objects of A.",
    "objects_b": "Objects of B.",
    "metric": "What is compared.",
    "verdict": "What the numbers show.",
    "mean_a": "The mean of the scores of A.",
    "mean_b": "The mean of the scores of B.",
    "high": "The upper end of the interval.",
    "n_b": "Scores of B.",
    "lacking_b": "Objects with a finite score in A only.",
    "shift": "See `scale`.",
    "mean": "Degrees.",
    "median": "Degrees.",
    "rmse": "Degrees.",
    "predicted_pixels": "Pixels of the predicted mask.",
    "true_pixels": "Pixels of the true mask.",
    "iou": "Intersection over union.",
    "precision": "Predicted pixels that are true, 0 to 1.",
    "recall": "True pixels that are predicted, 0 to 1.",
    "note": "What to know of the model.",
    "fy": "Pixels.",
    "cx": "Pixels from the left edge.",
    "cy": "Pixels from the upper edge.",
}
