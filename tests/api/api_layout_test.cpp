// The frozen binary layout of the public structs. A row may be added at the end of a struct; no row
// may change.
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>
#include <vector>

#include "api/layout/layout_evaluate.h"
#include "api/layout/layout_files.h"
#include "api/layout/layout_network.h"
#include "api/layout/layout_optimizer.h"
#include "api/layout/layout_predict.h"
#include "api/layout/layout_prior_models.h"
#include "api/layout/layout_priors.h"
#include "api/layout/layout_training.h"
#include "api/public_headers.h"

namespace splat::test {
namespace {

const Layout kDeviceInfo = {  // clang-format off
    "splat_device_info",
    sizeof(splat_device_info),
    864,
    {
    SPLAT_FIELD(splat_device_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_device_info, index, 4, 4),
    SPLAT_FIELD(splat_device_info, kind, 8, 4),
    SPLAT_FIELD(splat_device_info, usable, 12, 4),
    SPLAT_FIELD(splat_device_info, vendor_id, 16, 4),
    SPLAT_FIELD(splat_device_info, device_id, 20, 4),
    SPLAT_FIELD(splat_device_info, vulkan_version, 24, 4),
    SPLAT_FIELD(splat_device_info, driver_version, 28, 4),
    SPLAT_FIELD(splat_device_info, uuid, 32, 16),
    SPLAT_FIELD(splat_device_info, heap_bytes, 48, 8),
    SPLAT_FIELD(splat_device_info, max_allocation_bytes, 56, 8),
    SPLAT_FIELD(splat_device_info, max_storage_buffer_bytes, 64, 8),
    SPLAT_FIELD(splat_device_info, max_workgroup_invocations, 72, 4),
    SPLAT_FIELD(splat_device_info, shared_memory_bytes, 76, 4),
    SPLAT_FIELD(splat_device_info, subgroup_size, 80, 4),
    SPLAT_FIELD(splat_device_info, features, 84, 4),
    SPLAT_FIELD(splat_device_info, kernels, 88, 4),
    SPLAT_FIELD(splat_device_info, reserved, 92, 4),
    SPLAT_FIELD(splat_device_info, name, 96, 256),
    SPLAT_FIELD(splat_device_info, driver, 352, 256),
    SPLAT_FIELD(splat_device_info, reason, 608, 256),}
};  // clang-format on

const Layout kDeviceDesc = {  // clang-format off
    "splat_device_desc",
    sizeof(splat_device_desc),
    72,
    {
    SPLAT_FIELD(splat_device_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_device_desc, flags, 4, 4),
    SPLAT_FIELD(splat_device_desc, next, 8, 8),
    SPLAT_FIELD(splat_device_desc, select, 16, 4),
    SPLAT_FIELD(splat_device_desc, index, 20, 4),
    SPLAT_FIELD(splat_device_desc, kind, 24, 4),
    SPLAT_FIELD(splat_device_desc, kernels, 28, 4),
    SPLAT_FIELD(splat_device_desc, uuid, 32, 16),
    SPLAT_FIELD(splat_device_desc, max_device_bytes, 48, 8),
    SPLAT_FIELD(splat_device_desc, timeout_ns, 56, 8),
    SPLAT_FIELD(splat_device_desc, cache_folder, 64, 8),}
};  // clang-format on

const Layout kMemoryInfo = {  // clang-format off
    "splat_memory_info",
    sizeof(splat_memory_info),
    40,
    {
    SPLAT_FIELD(splat_memory_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_memory_info, allocations, 4, 4),
    SPLAT_FIELD(splat_memory_info, used_bytes, 8, 8),
    SPLAT_FIELD(splat_memory_info, live_bytes, 16, 8),
    SPLAT_FIELD(splat_memory_info, peak_bytes, 24, 8),
    SPLAT_FIELD(splat_memory_info, budget_bytes, 32, 8),}
};  // clang-format on

const Layout kTensorDesc = {  // clang-format off
    "splat_tensor_desc",
    sizeof(splat_tensor_desc),
    96,
    {
    SPLAT_FIELD(splat_tensor_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_tensor_desc, flags, 4, 4),
    SPLAT_FIELD(splat_tensor_desc, next, 8, 8),
    SPLAT_FIELD(splat_tensor_desc, name, 16, 8),
    SPLAT_FIELD(splat_tensor_desc, dtype, 24, 4),
    SPLAT_FIELD(splat_tensor_desc, rank, 28, 4),
    SPLAT_FIELD(splat_tensor_desc, dims, 32, 64),}
};  // clang-format on

const Layout kTensorInfo = {  // clang-format off
    "splat_tensor_info",
    sizeof(splat_tensor_info),
    160,
    {
    SPLAT_FIELD(splat_tensor_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_tensor_info, dtype, 4, 4),
    SPLAT_FIELD(splat_tensor_info, rank, 8, 4),
    SPLAT_FIELD(splat_tensor_info, mapped, 12, 4),
    SPLAT_FIELD(splat_tensor_info, dims, 16, 64),
    SPLAT_FIELD(splat_tensor_info, elements, 80, 8),
    SPLAT_FIELD(splat_tensor_info, bytes, 88, 8),
    SPLAT_FIELD(splat_tensor_info, name, 96, 64),}
};  // clang-format on

const Layout kTensorStats = {  // clang-format off
    "splat_tensor_stats",
    sizeof(splat_tensor_stats),
    48,
    {
    SPLAT_FIELD(splat_tensor_stats, struct_size, 0, 4),
    SPLAT_FIELD(splat_tensor_stats, reserved, 4, 4),
    SPLAT_FIELD(splat_tensor_stats, nan_count, 8, 8),
    SPLAT_FIELD(splat_tensor_stats, inf_count, 16, 8),
    SPLAT_FIELD(splat_tensor_stats, min, 24, 8),
    SPLAT_FIELD(splat_tensor_stats, max, 32, 8),
    SPLAT_FIELD(splat_tensor_stats, mean, 40, 8),}
};  // clang-format on

const Layout kOpDesc = {  // clang-format off
    "splat_op_desc",
    sizeof(splat_op_desc),
    72,
    {
    SPLAT_FIELD(splat_op_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_op_desc, flags, 4, 4),
    SPLAT_FIELD(splat_op_desc, next, 8, 8),
    SPLAT_FIELD(splat_op_desc, type, 16, 8),
    SPLAT_FIELD(splat_op_desc, attributes, 24, 8),
    SPLAT_FIELD(splat_op_desc, input_count, 32, 4),
    SPLAT_FIELD(splat_op_desc, output_count, 36, 4),
    SPLAT_FIELD(splat_op_desc, inputs, 40, 8),
    SPLAT_FIELD(splat_op_desc, outputs, 48, 8),
    SPLAT_FIELD(splat_op_desc, grad_outputs, 56, 8),
    SPLAT_FIELD(splat_op_desc, grad_inputs, 64, 8),}
};  // clang-format on

const Layout kSceneDesc = {  // clang-format off
    "splat_scene_desc",
    sizeof(splat_scene_desc),
    112,
    {
    SPLAT_FIELD(splat_scene_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_scene_desc, flags, 4, 4),
    SPLAT_FIELD(splat_scene_desc, next, 8, 8),
    SPLAT_FIELD(splat_scene_desc, count, 16, 8),
    SPLAT_FIELD(splat_scene_desc, sh_degree, 24, 4),
    SPLAT_FIELD(splat_scene_desc, reserved, 28, 4),
    SPLAT_FIELD(splat_scene_desc, means, 32, 8),
    SPLAT_FIELD(splat_scene_desc, log_scales, 40, 8),
    SPLAT_FIELD(splat_scene_desc, rotations, 48, 8),
    SPLAT_FIELD(splat_scene_desc, opacity_logits, 56, 8),
    SPLAT_FIELD(splat_scene_desc, sh, 64, 8),
    SPLAT_FIELD(splat_scene_desc, mean_count, 72, 8),
    SPLAT_FIELD(splat_scene_desc, log_scale_count, 80, 8),
    SPLAT_FIELD(splat_scene_desc, rotation_count, 88, 8),
    SPLAT_FIELD(splat_scene_desc, opacity_logit_count, 96, 8),
    SPLAT_FIELD(splat_scene_desc, sh_count, 104, 8),}
};  // clang-format on

const Layout kSceneFileDesc = {  // clang-format off
    "splat_scene_file_desc",
    sizeof(splat_scene_file_desc),
    40,
    {
    SPLAT_FIELD(splat_scene_file_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_scene_file_desc, flags, 4, 4),
    SPLAT_FIELD(splat_scene_file_desc, next, 8, 8),
    SPLAT_FIELD(splat_scene_file_desc, format, 16, 4),
    SPLAT_FIELD(splat_scene_file_desc, frame, 20, 4),
    SPLAT_FIELD(splat_scene_file_desc, sh_degree, 24, 4),
    SPLAT_FIELD(splat_scene_file_desc, spz_version, 28, 4),
    SPLAT_FIELD(splat_scene_file_desc, max_count, 32, 8),}
};  // clang-format on

const Layout kSimilarity = {  // clang-format off
    "splat_similarity",
    sizeof(splat_similarity),
    64,
    {
    SPLAT_FIELD(splat_similarity, rotation, 0, 32),
    SPLAT_FIELD(splat_similarity, translation, 32, 24),
    SPLAT_FIELD(splat_similarity, scale, 56, 8),}
};  // clang-format on

const Layout kSceneInfo = {  // clang-format off
    "splat_scene_info",
    sizeof(splat_scene_info),
    176,
    {
    SPLAT_FIELD(splat_scene_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_scene_info, sh_degree, 4, 4),
    SPLAT_FIELD(splat_scene_info, count, 8, 8),
    SPLAT_FIELD(splat_scene_info, low, 16, 24),
    SPLAT_FIELD(splat_scene_info, high, 40, 24),
    SPLAT_FIELD(splat_scene_info, center, 64, 24),
    SPLAT_FIELD(splat_scene_info, radius, 88, 8),
    SPLAT_FIELD(splat_scene_info, scale_min, 96, 8),
    SPLAT_FIELD(splat_scene_info, scale_max, 104, 8),
    SPLAT_FIELD(splat_scene_info, scale_mean, 112, 8),
    SPLAT_FIELD(splat_scene_info, opacity_min, 120, 8),
    SPLAT_FIELD(splat_scene_info, opacity_max, 128, 8),
    SPLAT_FIELD(splat_scene_info, opacity_mean, 136, 8),
    SPLAT_FIELD(splat_scene_info, non_finite, 144, 8),
    SPLAT_FIELD(splat_scene_info, bad_rotations, 152, 8),
    SPLAT_FIELD(splat_scene_info, degenerate, 160, 8),
    SPLAT_FIELD(splat_scene_info, invisible, 168, 8),}
};  // clang-format on

const Layout kCamera = {  // clang-format off
    "splat_camera",
    sizeof(splat_camera),
    168,
    {
    SPLAT_FIELD(splat_camera, width, 0, 4),
    SPLAT_FIELD(splat_camera, height, 4, 4),
    SPLAT_FIELD(splat_camera, fx, 8, 8),
    SPLAT_FIELD(splat_camera, fy, 16, 8),
    SPLAT_FIELD(splat_camera, cx, 24, 8),
    SPLAT_FIELD(splat_camera, cy, 32, 8),
    SPLAT_FIELD(splat_camera, world_to_camera, 40, 128),}
};  // clang-format on

const Layout kImage = {  // clang-format off
    "splat_image",
    sizeof(splat_image),
    56,
    {
    SPLAT_FIELD(splat_image, pixels, 0, 8),
    SPLAT_FIELD(splat_image, bytes, 8, 8),
    SPLAT_FIELD(splat_image, type, 16, 4),
    SPLAT_FIELD(splat_image, width, 20, 4),
    SPLAT_FIELD(splat_image, height, 24, 4),
    SPLAT_FIELD(splat_image, channels, 28, 4),
    SPLAT_FIELD(splat_image, row_stride, 32, 8),
    SPLAT_FIELD(splat_image, pixel_stride, 40, 8),
    SPLAT_FIELD(splat_image, channel_stride, 48, 8),}
};  // clang-format on

const Layout kOrbitDesc = {  // clang-format off
    "splat_orbit_desc",
    sizeof(splat_orbit_desc),
    80,
    {
    SPLAT_FIELD(splat_orbit_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_orbit_desc, flags, 4, 4),
    SPLAT_FIELD(splat_orbit_desc, next, 8, 8),
    SPLAT_FIELD(splat_orbit_desc, width, 16, 4),
    SPLAT_FIELD(splat_orbit_desc, height, 20, 4),
    SPLAT_FIELD(splat_orbit_desc, fov_x, 24, 8),
    SPLAT_FIELD(splat_orbit_desc, elevation, 32, 8),
    SPLAT_FIELD(splat_orbit_desc, start, 40, 8),
    SPLAT_FIELD(splat_orbit_desc, distance, 48, 8),
    SPLAT_FIELD(splat_orbit_desc, up, 56, 24),}
};  // clang-format on

const Layout kCameraFileDesc = {  // clang-format off
    "splat_camera_file_desc",
    sizeof(splat_camera_file_desc),
    24,
    {
    SPLAT_FIELD(splat_camera_file_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_camera_file_desc, flags, 4, 4),
    SPLAT_FIELD(splat_camera_file_desc, next, 8, 8),
    SPLAT_FIELD(splat_camera_file_desc, width, 16, 4),
    SPLAT_FIELD(splat_camera_file_desc, height, 20, 4),}
};  // clang-format on

const Layout kRasterizerDesc = {  // clang-format off
    "splat_rasterizer_desc",
    sizeof(splat_rasterizer_desc),
    56,
    {
    SPLAT_FIELD(splat_rasterizer_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_rasterizer_desc, flags, 4, 4),
    SPLAT_FIELD(splat_rasterizer_desc, next, 8, 8),
    SPLAT_FIELD(splat_rasterizer_desc, gaussians, 16, 4),
    SPLAT_FIELD(splat_rasterizer_desc, views, 20, 4),
    SPLAT_FIELD(splat_rasterizer_desc, width, 24, 4),
    SPLAT_FIELD(splat_rasterizer_desc, height, 28, 4),
    SPLAT_FIELD(splat_rasterizer_desc, sh_degree, 32, 4),
    SPLAT_FIELD(splat_rasterizer_desc, disabled_skips, 36, 4),
    SPLAT_FIELD(splat_rasterizer_desc, convention, 40, 4),
    SPLAT_FIELD(splat_rasterizer_desc, near_plane, 44, 4),
    SPLAT_FIELD(splat_rasterizer_desc, far_plane, 48, 4),
    SPLAT_FIELD(splat_rasterizer_desc, reserved, 52, 4),}
};  // clang-format on

const Layout kGaussiansDesc = {  // clang-format off
    "splat_gaussians_desc",
    sizeof(splat_gaussians_desc),
    64,
    {
    SPLAT_FIELD(splat_gaussians_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_gaussians_desc, flags, 4, 4),
    SPLAT_FIELD(splat_gaussians_desc, next, 8, 8),
    SPLAT_FIELD(splat_gaussians_desc, means, 16, 8),
    SPLAT_FIELD(splat_gaussians_desc, scales, 24, 8),
    SPLAT_FIELD(splat_gaussians_desc, rotations, 32, 8),
    SPLAT_FIELD(splat_gaussians_desc, opacities, 40, 8),
    SPLAT_FIELD(splat_gaussians_desc, sh, 48, 8),
    SPLAT_FIELD(splat_gaussians_desc, colors, 56, 8),}
};  // clang-format on

const Layout kGradientsDesc = {  // clang-format off
    "splat_gradients_desc",
    sizeof(splat_gradients_desc),
    112,
    {
    SPLAT_FIELD(splat_gradients_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_gradients_desc, flags, 4, 4),
    SPLAT_FIELD(splat_gradients_desc, next, 8, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_rgb, 16, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_alpha, 24, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_depth, 32, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_means, 40, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_scales, 48, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_rotations, 56, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_opacities, 64, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_sh, 72, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_colors, 80, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_means2d, 88, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_means2d_abs, 96, 8),
    SPLAT_FIELD(splat_gradients_desc, grad_world_to_camera, 104, 8),}
};  // clang-format on

const Layout kRasterizerInfo = {  // clang-format off
    "splat_rasterizer_info",
    sizeof(splat_rasterizer_info),
    88,
    {
    SPLAT_FIELD(splat_rasterizer_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_rasterizer_info, passes, 4, 4),
    SPLAT_FIELD(splat_rasterizer_info, visible, 8, 8),
    SPLAT_FIELD(splat_rasterizer_info, pairs, 16, 8),
    SPLAT_FIELD(splat_rasterizer_info, longest, 24, 8),
    SPLAT_FIELD(splat_rasterizer_info, tiles, 32, 8),
    SPLAT_FIELD(splat_rasterizer_info, empty_tiles, 40, 8),
    SPLAT_FIELD(splat_rasterizer_info, bytes, 48, 8),
    SPLAT_FIELD(splat_rasterizer_info, runs, 56, 4),
    SPLAT_FIELD(splat_rasterizer_info, gaussians, 60, 4),
    SPLAT_FIELD(splat_rasterizer_info, views, 64, 4),
    SPLAT_FIELD(splat_rasterizer_info, reserved, 68, 4),
    SPLAT_FIELD(splat_rasterizer_info, culled, 72, 8),
    SPLAT_FIELD(splat_rasterizer_info, non_finite, 80, 8),}
};  // clang-format on

const Layout kSceneRenderDesc = {  // clang-format off
    "splat_scene_render_desc",
    sizeof(splat_scene_render_desc),
    40,
    {
    SPLAT_FIELD(splat_scene_render_desc, struct_size, 0, 4),
    SPLAT_FIELD(splat_scene_render_desc, flags, 4, 4),
    SPLAT_FIELD(splat_scene_render_desc, next, 8, 8),
    SPLAT_FIELD(splat_scene_render_desc, output, 16, 4),
    SPLAT_FIELD(splat_scene_render_desc, convention, 20, 4),
    SPLAT_FIELD(splat_scene_render_desc, background, 24, 12),
    SPLAT_FIELD(splat_scene_render_desc, reserved, 36, 4),}
};  // clang-format on

const Layout kLayouts[] = {
    kTrainingDesc,   kTrainingEvent,  kPictureSource,     kPicture,        kPictureInfo,
    kPictureCutDesc, kPredictorDesc,  kPredictorInfo,     kPrediction,     kDatasetDesc,
    kDatasetViews,   kSyntheticDesc,  kTrainerDesc,       kTrainerBatch,   kTrainerInfo,
    kLpipsDesc,      kImageScores,    kModelDesc,         kModelInput,     kDeviceInfo,
    kDeviceDesc,     kMemoryInfo,     kTensorDesc,        kTensorInfo,     kTensorStats,
    kOpDesc,         kSceneDesc,      kSceneFileDesc,     kSimilarity,     kSceneInfo,
    kCamera,         kOrbitDesc,      kCameraFileDesc,    kRasterizerDesc, kGaussiansDesc,
    kGradientsDesc,  kRasterizerInfo, kSceneRenderDesc,   kWeightsInfo,    kModuleDesc,
    kImage,          kModelGradients, kModelInfo,         kPort,           kOptimizerItem,
    kOptimizerGroup, kOptimizerDesc,  kOptimizerInfo,     kImageInfo,      kNamedArray,
    kCameraBytes,    kEvaluatorDesc,  kEvaluatorInfo,     kScores,         kLedger,
    kObjectScores,   kEvaluatedViews, kEvaluationSummary, kScore,          kScoreSet,
    kCompareDesc,    kComparisonInfo, kMetricComparison,  kDepthScores,    kNormalScores,
    kMaskScores,     kFidelityScores, kPointScores,       kCo3dDesc,       kCo3dInfo,
    kDatasetImport,  kDatasetExport,  kPriorModelDesc,    kPriorModelInfo, kPriorMaps,
    kNormalsDesc,    kDecodeLimits};

/// Differences of a struct from its frozen layout, and bytes that belong to no field.
std::vector<std::string> defects(const Layout& layout) {
    std::vector<std::string> found;
    std::size_t end = 0;
    for (const Field& field : layout.fields) {
        const std::string name = std::string(layout.name) + "." + field.name;
        if (field.offset != field.frozen_offset || field.size != field.frozen_size)
            found.push_back(name + " moved or changed its size");
        if (field.offset != end) found.push_back("padding before " + name);
        end = field.offset + field.size;
    }
    if (layout.size != layout.frozen_size)
        found.push_back(std::string(layout.name) + " has " + std::to_string(layout.size) +
                        " bytes");
    if (layout.size != end)
        found.push_back(std::string("padding or a new field at the end of ") + layout.name);
    return found;
}

TEST(ApiLayout, IsFrozenAndWithoutPadding) {
    if (sizeof(void*) != 8) GTEST_SKIP() << "the table is that of 64-bit machines";
    for (const Layout& layout : kLayouts)
        for (const std::string& defect : defects(layout)) ADD_FAILURE() << defect;
}

TEST(ApiLayout, FindsWhatChanged) {
    const auto found = [](Field field, std::size_t size, std::size_t frozen_size) {
        return defects({"s", size, frozen_size, {{"a", 0, 4, 0, 4}, field}}).size();
    };
    EXPECT_EQ(found({"b", 4, 4, 4, 4}, 8, 8), 0U);
    EXPECT_EQ(found({"b", 8, 8, 8, 8}, 16, 16), 1U) << "a gap";
    EXPECT_EQ(found({"b", 4, 8, 4, 4}, 12, 12), 1U) << "a wider field";
    EXPECT_EQ(found({"b", 4, 4, 4, 4}, 12, 12), 1U) << "bytes at the end";
    EXPECT_EQ(found({"b", 4, 8, 4, 8}, 12, 8), 1U) << "a larger struct";
}

TEST(ApiLayout, KnowsEveryStructOfTheHeader) {
    const std::string header = public_headers();
    std::set<std::string> known;
    for (const Layout& layout : kLayouts) known.insert(layout.name);
    const std::regex definition(R"(typedef struct (splat_\w+) \{)");
    std::size_t count = 0;
    for (std::sregex_iterator it(header.begin(), header.end(), definition), end; it != end; ++it) {
        ++count;
        EXPECT_EQ(known.count((*it)[1]), 1U) << (*it)[1] << " has no rows in the table";
    }
    EXPECT_EQ(count, known.size());
}

TEST(ApiLayout, BuildInfoHasTheSizeOfEveryStruct) {
    const std::string info = splat_build_info();
    const std::size_t start = info.find("\"structs\"");
    ASSERT_NE(start, std::string::npos);
    for (const Layout& layout : kLayouts) {
        const std::string name = std::string("\"") + layout.name + "\"";
        const std::size_t at = info.find(name, start);
        ASSERT_NE(at, std::string::npos) << layout.name << " is not in splat_build_info";
        EXPECT_EQ(std::stoul(info.substr(info.find(':', at) + 1)), layout.size) << layout.name;
    }
}

TEST(ApiLayout, SimpleTypesAreFixed) {
    static_assert(std::is_same_v<splat_result, std::int32_t>);
    static_assert(std::is_same_v<splat_log_level, std::int32_t>);
    static_assert(std::is_same_v<splat_device_kind, std::int32_t>);
    static_assert(std::is_same_v<splat_kernels, std::int32_t>);
    static_assert(std::is_same_v<splat_device_select, std::int32_t>);
    static_assert(std::is_same_v<splat_dtype, std::int32_t>);
    static_assert(std::is_same_v<splat_access, std::int32_t>);
    static_assert(sizeof(splat_device) == sizeof(void*) && sizeof(splat_tensor) == sizeof(void*));
    static_assert(std::is_same_v<splat_scene_format, std::int32_t>);
    static_assert(std::is_same_v<splat_frame, std::int32_t>);
    static_assert(std::is_same_v<splat_convention, std::int32_t>);
    static_assert(std::is_same_v<splat_output, std::int32_t>);
    static_assert(std::is_same_v<splat_found, std::int32_t>);
    static_assert(std::is_same_v<splat_port_kind, std::int32_t>);
    static_assert(std::is_same_v<splat_training_event_kind, std::int32_t>);
    static_assert(sizeof(splat_scene) == sizeof(void*));
    static_assert(sizeof(splat_rasterizer) == sizeof(void*));
    static_assert(sizeof(splat_weights) == sizeof(void*));
    static_assert(sizeof(splat_dataset) == sizeof(void*));
    static_assert(sizeof(splat_model) == sizeof(void*));
    static_assert(sizeof(splat_op) == sizeof(void*) && SPLAT_MAX_RANK == 8);
}

}  // namespace
}  // namespace splat::test
