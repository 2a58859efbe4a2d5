/* Compiled as C and as C++ by header_tests.cmake. The variables make clang lay out the structs, so
 * that -Wpadded sees them; a test of the house checks that none is left out. */
#include <splat.h>

splat_image sample_image;
splat_device_info sample_device_info;
splat_device_desc sample_device_desc;
splat_memory_info sample_memory_info;
splat_tensor_desc sample_tensor_desc;
splat_tensor_info sample_tensor_info;
splat_tensor_stats sample_tensor_stats;
splat_op_desc sample_op_desc;
splat_scene_desc sample_scene_desc;
splat_scene_file_desc sample_scene_file_desc;
splat_similarity sample_similarity;
splat_scene_info sample_scene_info;
splat_camera sample_camera;
splat_orbit_desc sample_orbit_desc;
splat_camera_file_desc sample_camera_file_desc;
splat_rasterizer_desc sample_rasterizer_desc;
splat_gaussians_desc sample_gaussians_desc;
splat_gradients_desc sample_gradients_desc;
splat_rasterizer_info sample_rasterizer_info;
splat_weights_info sample_weights_info;
splat_dataset_desc sample_dataset_desc;
splat_dataset_views sample_dataset_views;
splat_synthetic_desc sample_synthetic_desc;
splat_model_desc sample_model_desc;
splat_model_input sample_model_input;
splat_module_desc sample_module_desc;
splat_photo_desc sample_photo_desc;
splat_trainer_desc sample_trainer_desc;
splat_trainer_batch sample_trainer_batch;
splat_trainer_info sample_trainer_info;
splat_lpips_desc sample_lpips_desc;
splat_image_scores sample_image_scores;
