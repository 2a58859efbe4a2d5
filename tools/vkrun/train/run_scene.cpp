#include "vkrun/train/run_scene.h"

#include <filesystem>

#include "core/os/path.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/config/merged_config.h"
#include "vkrun/data/open_data.h"
#include "vkrun/eval/object_views.h"
#include "vkrun/scene/camera_file.h"
#include "vkrun/scene/scene_file.h"
#include "vkrun/view/scene_viewer.h"

namespace vkrun {
namespace {

std::string scene_path(const std::string& folder) {
    return folder + "/renders/best.ply";
}

std::string cameras_path(const std::string& folder) {
    return folder + "/renders/best.json";
}

}  // namespace

void save_run_scene(const std::string& folder, const std::string& device) {
    const std::string weights = folder + "/weights_best.safetensors";
    const Json config = merged_config(folder + "/config.json", {});
    const std::string text = config.dump();
    const Dataset data = open_data(config, "", "val");
    const Device opened = open_device(device_desc(device));
    auto desc = sized<splat_predictor_desc>();
    desc.weights_path = weights.c_str();
    desc.config = text.c_str();
    ScenePredictor predictor;
    check(splat_predictor_create(opened.get(), &desc, predictor.out()));
    auto evaluated = sized<splat_evaluator_desc>();
    evaluated.predictor = predictor.get();
    evaluated.dataset = data.get();
    evaluated.method = "page";
    evaluated.novel_views = config.at("logging").at("val_views");
    evaluated.objects = 1;
    Evaluator evaluator;
    check(splat_evaluator_create(&evaluated, evaluator.out()));
    const ObjectViews views = read_views(evaluator.get(), 0, true);
    Scene scene;
    check(splat_predictor_predict_object(predictor.get(), data.get(), 0, views.numbers.data(),
                                         static_cast<std::uint32_t>(views.numbers.size()),
                                         scene.out(), nullptr));
    check(splat_scene_save(scene.get(), scene_path(folder).c_str(), nullptr));
    check(splat_camera_save(cameras_path(folder).c_str(), views.cameras.data(), nullptr,
                            static_cast<std::uint32_t>(views.cameras.size())));
}

void add_run_scene(HtmlPage& page, const std::string& folder) {
    std::error_code none;
    if (!std::filesystem::exists(splat::os::path_of(scene_path(folder)), none) ||
        !std::filesystem::exists(splat::os::path_of(cameras_path(folder)), none))
        return;
    const SceneFile file = load_scene(scene_path(folder));
    if (file.info.count == 0) return;  // the network predicted nothing that can be seen
    ViewerOptions viewer;
    viewer.name = "the first validation object, by the best weights";
    viewer.cameras = load_cameras(cameras_path(folder), {}).cameras;
    viewer.instead = "Renders of it are below.";
    const Json config = merged_config(folder + "/config.json", {});
    if (config.at("data").at("white_background").get<bool>())
        for (float& value : viewer.background) value = 1;
    up_of(viewer.cameras, viewer.up);
    viewer.turning = true;
    add_viewer(page, file.scene.get(), viewer);
}

}  // namespace vkrun
