#pragma once

#include "core/config.h"
#include "model/predictor_config.h"

namespace splat::model {

/// The network of a configuration as the published ones are written (Hydra's merged config.yaml), with
/// these keys; others of its sections say nothing about the network and are passed over, unknown ones of
/// the sections data, cam_embd and model are refused.
///
///   data      training_resolution fov znear zfar input_images category origin_distances
///             use_pred_depth use_pred_normal use_mask custom_embedding
///   cam_embd  embedding (null, pose, index) dimension method (film) encode_embedding (positional) film
///             (reference, affine); without an embedding method and encode_embedding may be anything
///             published files have
///   model     base_dim num_blocks channel_mult attention_resolutions cross_view_attention dropout
///             max_sh_degree isotropic network_with_offset network_without_offset inverted_x inverted_y
///             depth_scale depth_bias xyz_scale xyz_bias opacity_scale opacity_bias scale_scale
///             scale_bias token_dim tokens
///   opt       freeze lora_finetune lora_rank lora_alpha lora_dropout lora_targets train_with_adapters
///
/// The categories hydrants and teddybears mean CO3D's geometry, as in the published code: fov 0, and origin
/// distances. model.out_channels is passed over.
///
/// Errors  kInvalidArgument, naming file and key, for a value of another kind or beyond its range, or one
///         that contradicts the category
Result<PredictorConfig> predictor_config(const Config& config);

/// CO3D: each view has focal lengths of its own, and depths are relative to the distance of the origin.
bool is_co3d_category(const std::string& category);

/// The same as JSON that predictor_config() reads back.
std::string config_text(const PredictorConfig& config);

}  // namespace splat::model
