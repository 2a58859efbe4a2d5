#include <string>

#include "api/api_guard.h"
#include "core/json_writer.h"
#include "vk/shaders.h"

#define SPLAT_TEXT_(x) #x
#define SPLAT_TEXT(x) SPLAT_TEXT_(x)

namespace {

#ifdef NDEBUG
constexpr bool kAssertions = false;
#else
constexpr bool kAssertions = true;
#endif

struct StructSize {
    const char* name;
    std::size_t bytes;
};

constexpr StructSize kStructs[] = {
    {"splat_camera", sizeof(splat_camera)},
    {"splat_camera_bytes", sizeof(splat_camera_bytes)},
    {"splat_camera_file_desc", sizeof(splat_camera_file_desc)},
    {"splat_co3d_desc", sizeof(splat_co3d_desc)},
    {"splat_co3d_info", sizeof(splat_co3d_info)},
    {"splat_compare_desc", sizeof(splat_compare_desc)},
    {"splat_comparison_info", sizeof(splat_comparison_info)},
    {"splat_dataset_desc", sizeof(splat_dataset_desc)},
    {"splat_dataset_export_desc", sizeof(splat_dataset_export_desc)},
    {"splat_dataset_import_desc", sizeof(splat_dataset_import_desc)},
    {"splat_dataset_views", sizeof(splat_dataset_views)},
    {"splat_decode_limits", sizeof(splat_decode_limits)},
    {"splat_depth_scores", sizeof(splat_depth_scores)},
    {"splat_device_desc", sizeof(splat_device_desc)},
    {"splat_device_info", sizeof(splat_device_info)},
    {"splat_evaluated_views", sizeof(splat_evaluated_views)},
    {"splat_evaluation_summary", sizeof(splat_evaluation_summary)},
    {"splat_evaluator_desc", sizeof(splat_evaluator_desc)},
    {"splat_evaluator_info", sizeof(splat_evaluator_info)},
    {"splat_fidelity_scores", sizeof(splat_fidelity_scores)},
    {"splat_gaussians_desc", sizeof(splat_gaussians_desc)},
    {"splat_gradients_desc", sizeof(splat_gradients_desc)},
    {"splat_image", sizeof(splat_image)},
    {"splat_image_info", sizeof(splat_image_info)},
    {"splat_image_scores", sizeof(splat_image_scores)},
    {"splat_ledger", sizeof(splat_ledger)},
    {"splat_lpips_desc", sizeof(splat_lpips_desc)},
    {"splat_mask_scores", sizeof(splat_mask_scores)},
    {"splat_memory_info", sizeof(splat_memory_info)},
    {"splat_metric_comparison", sizeof(splat_metric_comparison)},
    {"splat_model_desc", sizeof(splat_model_desc)},
    {"splat_model_gradients", sizeof(splat_model_gradients)},
    {"splat_model_info", sizeof(splat_model_info)},
    {"splat_model_input", sizeof(splat_model_input)},
    {"splat_module_desc", sizeof(splat_module_desc)},
    {"splat_named_array", sizeof(splat_named_array)},
    {"splat_normal_scores", sizeof(splat_normal_scores)},
    {"splat_normals_desc", sizeof(splat_normals_desc)},
    {"splat_number", sizeof(splat_number)},
    {"splat_object_scores", sizeof(splat_object_scores)},
    {"splat_op_desc", sizeof(splat_op_desc)},
    {"splat_optimizer_desc", sizeof(splat_optimizer_desc)},
    {"splat_optimizer_group", sizeof(splat_optimizer_group)},
    {"splat_optimizer_info", sizeof(splat_optimizer_info)},
    {"splat_optimizer_item", sizeof(splat_optimizer_item)},
    {"splat_orbit_desc", sizeof(splat_orbit_desc)},
    {"splat_picture", sizeof(splat_picture)},
    {"splat_picture_cut_desc", sizeof(splat_picture_cut_desc)},
    {"splat_picture_info", sizeof(splat_picture_info)},
    {"splat_picture_source", sizeof(splat_picture_source)},
    {"splat_point_scores", sizeof(splat_point_scores)},
    {"splat_port", sizeof(splat_port)},
    {"splat_prediction", sizeof(splat_prediction)},
    {"splat_predictor_desc", sizeof(splat_predictor_desc)},
    {"splat_predictor_info", sizeof(splat_predictor_info)},
    {"splat_prior_maps", sizeof(splat_prior_maps)},
    {"splat_prior_model_desc", sizeof(splat_prior_model_desc)},
    {"splat_prior_model_info", sizeof(splat_prior_model_info)},
    {"splat_rasterizer_desc", sizeof(splat_rasterizer_desc)},
    {"splat_rasterizer_info", sizeof(splat_rasterizer_info)},
    {"splat_run_event", sizeof(splat_run_event)},
    {"splat_scene_desc", sizeof(splat_scene_desc)},
    {"splat_scene_file_desc", sizeof(splat_scene_file_desc)},
    {"splat_scene_info", sizeof(splat_scene_info)},
    {"splat_scene_render_desc", sizeof(splat_scene_render_desc)},
    {"splat_score", sizeof(splat_score)},
    {"splat_score_set", sizeof(splat_score_set)},
    {"splat_scores", sizeof(splat_scores)},
    {"splat_similarity", sizeof(splat_similarity)},
    {"splat_synthetic_desc", sizeof(splat_synthetic_desc)},
    {"splat_tensor_desc", sizeof(splat_tensor_desc)},
    {"splat_tensor_info", sizeof(splat_tensor_info)},
    {"splat_tensor_stats", sizeof(splat_tensor_stats)},
    {"splat_trainer_batch", sizeof(splat_trainer_batch)},
    {"splat_trainer_desc", sizeof(splat_trainer_desc)},
    {"splat_trainer_info", sizeof(splat_trainer_info)},
    {"splat_training_desc", sizeof(splat_training_desc)},
    {"splat_weights_info", sizeof(splat_weights_info)},
};

std::string make_build_info() {
    splat::JsonWriter json;
    json.begin_object().member("version", splat_version_string()).member("compiler", __VERSION__);
    json.member("assertions", kAssertions).member("fault_points", SPLAT_FAULT_POINTS != 0);
    json.newline(1).key("shaders").begin_array();
    for (const splat::vk::ShaderModule& module : splat::vk::shader_modules()) {
        json.newline(2).begin_object().member("name", module.name).member("hash", module.sha256);
        json.member("bytes", module.words.size_bytes()).end();
    }
    json.end().newline(1).key("structs").begin_object();
    for (const StructSize& row : kStructs) json.member(row.name, row.bytes);
    json.end().end();
    return json.text();
}

}  // namespace

uint32_t splat_version(void) {
    return SPLAT_VERSION;
}

const char* splat_version_string(void) {
    return SPLAT_TEXT(SPLAT_VERSION_MAJOR) "." SPLAT_TEXT(SPLAT_VERSION_MINOR) "." SPLAT_TEXT(
        SPLAT_VERSION_PATCH);
}

const char* splat_build_info(void) {
    try {
        static const std::string info = make_build_info();
        return info.c_str();
    } catch (...) {
        return "{}";
    }
}
