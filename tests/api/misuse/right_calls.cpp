// What makes a call right, where the usual arguments do not: the rows that follow from annotations change one of them.
#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr char kNoFormat[] = "no file of any kind";
constexpr const char* kNoMeshFile = "/nonexistent/mesh.obj";
constexpr const char* kNoImageFile = "/nonexistent/file.png";
constexpr double kOrigin[16] = {};
constexpr double kOnes[3] = {1, 1, 1};
constexpr double kBehind[3] = {0, 0, -4};
constexpr std::uint32_t kFirstView = 0;
constexpr float kFour[4] = {1, 2, 3, 4};

/// 48 x 48 pixels of 0.5.
splat_image grey_image(std::uint32_t channels) {
    static std::vector<float> pixels(std::size_t{4} * 48 * 48, 0.5F);
    return {pixels.data(), pixels.size() * 4, SPLAT_PIXEL_F32, 48, 48, channels, 0, 0, 0};
}

/// Planes with pixels of their own.
splat_image plane_image() {
    static std::deque<std::vector<float>> all;
    std::vector<float>& pixels = all.emplace_back(std::size_t{4} * 48 * 48, 1.0F);
    return {pixels.data(), pixels.size() * 4, SPLAT_PIXEL_F32, 48, 48, 4, 0, 0, 0};
}

const splat_image kMap = grey_image(1), kPicture = grey_image(3);

}  // namespace

#define SPLAT_RIGHT(function, without_room, ...) \
    right(#function, function, without_room, __VA_ARGS__)

void MisuseTable::right_descs() {
    static const std::string folder = run_folder();
    good(device_desc());
    good(tensor_desc({4}, "mine"));
    good(request_.desc());
    good(rasterizer_desc(3, 16, 16));
    good(model_desc());
    good(module_desc());
    good(trainer_desc());
    good(dataset_desc());
    good(synthetic_desc(data_folder()));
    good(training_desc(dataset_, folder));
    good(compare_desc());
    good(sample_camera(16, 16));
    good(mesh_desc());
    good(kPicture);
    good(splat_similarity{{1, 0, 0, 0}, {0, 0, 0}, 1});
    good(splat_named_array{"a", static_cast<float*>(kMap.pixels), 6, {2, 3}, 2, 0});
    static std::uint8_t black[16 * 16 * 4];
    good<splat_picture>().image.pixels = {
        black, sizeof black * 3 / 4, SPLAT_PIXEL_U8, 16, 16, 3, 0, 0, 0};
    good<splat_picture_cut_desc>().resolution = 16;
    good<splat_prior_maps>().mask = kMap;
    auto& views = good<splat_mesh_views_desc>();
    views.path = folder.c_str();
    views.name = "square";
    good<splat_mesh_maps>().color = {black, sizeof black * 3 / 4, SPLAT_PIXEL_U8, 16, 16, 3, 0, 0,
                                     0};
    good<splat_normals_desc>().focal_x = good<splat_normals_desc>().focal_y = 4;
    auto& target = good<splat_vulkan_target>();
    target.buffer = 1;  // never followed: the device is the library's own
    target.bytes = 16 * 16 * 4;
    target.format = 37;
    auto& bytes = good<splat_camera_bytes>();
    bytes.cameras = kNoFormat;
    bytes.camera_bytes = sizeof kNoFormat;
    auto& predictor = good<splat_predictor_desc>();
    predictor.weights = weights_handle_;
    predictor.config = kSmallModel;
    auto& evaluator = good<splat_evaluator_desc>();
    evaluator.dataset = dataset_;
    evaluator.method = "mine";
    auto& optimizer = good<splat_optimizer_desc>();
    optimizer.items = &item_;
    optimizer.item_count = 1;
    auto& lpips = good<splat_lpips_desc>();
    lpips.weights = &weights_handle_;
    lpips.weight_count = 1;
    lpips.side = 16;
    auto& prior = good<splat_prior_model_desc>();
    prior.preset = "u2net";
    prior.model_path = "/nowhere/u2net.onnx";
    prior.runtime_path = "/nowhere/libonnxruntime.so";
    auto& co3d = good<splat_co3d_desc>();
    co3d.raw = "/nonexistent";
    co3d.out = data_folder();
    co3d.category = "hydrant";
    auto& tokens = good<splat_tokens_desc>();
    tokens.data = data_folder();
    tokens.masks = "/nonexistent";
    tokens.names = "/nonexistent/palette.gpl";
    tokens.out = "/nonexistent/x.npz";
    good<splat_dataset_import_desc>().path = "/nonexistent";
    auto& to_write = good<splat_dataset_export_desc>();
    to_write.path = "/proc/x";
    to_write.layout = "srn";
}

void MisuseTable::right_calls() {
    constexpr splat_result kCut = SPLAT_INCOMPLETE;
    const splat_camera& camera = good<splat_camera>();
    auto& files = good<splat_scene_file_desc>();
    static splat_image mask = kMap, normal = kPicture;
    static std::uint8_t pixels[16 * 16 * 4];
    static const splat_image drawn = {pixels, sizeof pixels, SPLAT_PIXEL_U8, 16, 16, 4, 0, 0, 0};
    static auto ply = files;
    ply.format = SPLAT_SCENE_PLY;
    char* const text = text_out();
    void* const bytes = values_out();
    auto* const needed = out<std::size_t>();
    auto* const count = out<std::uint32_t>();
    SPLAT_RIGHT(splat_scene_save_memory, kCut, scene_, &ply, bytes, 64, needed);
    SPLAT_RIGHT(splat_scene_to_tensor, kCut, scene_, "means", device_, out<splat_tensor>());
    SPLAT_RIGHT(splat_predictor_predict, kCut, predictor_, &good<splat_picture>(), 1,
                out<splat_scene>(), nullptr);
    SPLAT_RIGHT(splat_predictor_predict_object, kCut, predictor_, dataset_, 0, &kFirstView, 1,
                out<splat_scene>(), nullptr);
    SPLAT_RIGHT(splat_camera_save_memory, kCut, &camera, nullptr, 1, bytes, 64, needed);
    SPLAT_RIGHT(splat_image_save, kCut, kNoImageFile, &kPicture);
    EXPECT_DONE(splat_image_save(image_file_.c_str(), &kPicture));
    SPLAT_RIGHT(splat_image_load, kCut, image_file_.c_str(), &normal, nullptr);
    SPLAT_RIGHT(splat_camera_look_at, kCut, out<splat_camera>(), kBehind, kOrigin, kOnes);
    SPLAT_RIGHT(splat_camera_load_report, kNotFound, kNoImageFile, nullptr, text, 16, needed);
    SPLAT_RIGHT(splat_camera_load_memory_report, kFormat, &good<splat_camera_bytes>(),
                &good<splat_camera_file_desc>(), text, 16, needed);
    SPLAT_RIGHT(splat_scene_crop, kCut, scene_, kOrigin, kOnes);
    SPLAT_RIGHT(splat_config_preset, kCut, "cars", text, 16, needed);
    SPLAT_RIGHT(splat_config_merge, kCut, nullptr, nullptr, 0, text, 16, needed);
    SPLAT_RIGHT(splat_config_check, kCut, nullptr, nullptr, 0, text, 16, needed);
    SPLAT_RIGHT(splat_builtin_weights, kCut, nullptr, text, 16, needed);
    SPLAT_RIGHT(splat_prior_preset, kCut, "u2net", text, 16, needed);
    SPLAT_RIGHT(splat_weights_find, kCut, weights_, "a", count);
    SPLAT_RIGHT(splat_dataset_read, kCut, dataset_, 0, &kFirstView, 1,
                &good<splat_dataset_views>());
    SPLAT_RIGHT(splat_evaluator_read, kCut, evaluator_, 0, &good<splat_evaluated_views>());
    SPLAT_RIGHT(splat_camera_load, kCut, kNoImageFile, nullptr, out<splat_camera>(), 1, count);
    SPLAT_RIGHT(splat_camera_save, kCut, kNoImageFile, &camera, nullptr, 1);
    SPLAT_RIGHT(splat_tensor_write, kCut, tensor_, kFour, 16, nullptr);
    SPLAT_RIGHT(splat_tensor_read, kCut, tensor_, values_out(), 16, nullptr);
    SPLAT_RIGHT(splat_tensor_from_host, kCut, device_, &good<splat_tensor_desc>(), kFour, 16,
                nullptr, out<splat_tensor>());
    SPLAT_RIGHT(splat_image_save_memory, kCut, &kPicture, SPLAT_IMAGE_PNG, bytes, 64, needed);
    SPLAT_RIGHT(splat_image_save_animation, kCut, kNoImageFile, &kPicture, 1, 50);
    SPLAT_RIGHT(splat_image_save_animation_memory, kCut, &kPicture, 1, 50, SPLAT_IMAGE_PNG, bytes,
                64, needed);
    SPLAT_RIGHT(splat_rasterizer_submit, kCut, rasterizer_, nullptr, scene_, &camera, nullptr,
                &good<splat_vulkan_target>(), out<splat_vulkan_frame>());
    SPLAT_RIGHT(splat_rasterizer_read_images, kCut, drawn_, nullptr, SPLAT_OUTPUT_RGB, 0, &drawn,
                1);
    SPLAT_RIGHT(splat_rasterizer_read, kCut, drawn_, nullptr, SPLAT_OUTPUT_DEPTHS, values_out(),
                64);
    SPLAT_RIGHT(splat_scene_render, kCut, scene_, device_, &camera, 1, nullptr, &drawn);
    SPLAT_RIGHT(splat_mesh_load, kCut, kNoMeshFile, nullptr, out<splat_mesh>());
    SPLAT_RIGHT(splat_mesh_sample, kCut, mesh_, 0, values_out(), 3);
    SPLAT_RIGHT(splat_mesh_render, kCut, mesh_, device_, &camera, 1, nullptr,
                &good<splat_mesh_maps>());
    SPLAT_RIGHT(splat_picture_mask, kCut, &kPicture, &mask, nullptr);
    SPLAT_RIGHT(splat_normals_from_depth, kCut, &kMap, &good<splat_normals_desc>(), &normal);
    static const splat_image found = plane_image(), truth = plane_image();
    SPLAT_RIGHT(splat_planes_from_depth, kCut, &kMap, nullptr, &good<splat_normals_desc>(),
                &good<splat_planes_desc>(), &found, nullptr);
    SPLAT_RIGHT(splat_prior_compare_planes, kCut, &truth, &truth, SPLAT_NORMAL_VECTORS, 0.05, 10,
                out<splat_plane_scores>());
    SPLAT_RIGHT(splat_prior_compare_depth, kCut, &kMap, &kMap, nullptr, 0,
                out<splat_depth_scores>());
    SPLAT_RIGHT(splat_prior_compare_normals, kCut, &kPicture, &kPicture, nullptr, 0,
                out<splat_normal_scores>());
    SPLAT_RIGHT(splat_prior_compare_masks, kCut, &kMap, &kMap, 0, out<splat_mask_scores>());
    SPLAT_RIGHT(splat_prior_filter, kCut, &kMap, SPLAT_MAP_FILTER_SOBEL, &mask);
    SPLAT_RIGHT(splat_points_from_mesh, kCut, kNoMeshFile, 0, values_out(), 3);
    SPLAT_RIGHT(splat_points_from_depth, kCut, &kMap, &camera, values_out(), 16, nullptr);
    SPLAT_RIGHT(splat_scene_compare_points, kCut, scene_, 0, values_out(), 3, 1,
                out<splat_point_scores>());
}

}  // namespace splat::test
