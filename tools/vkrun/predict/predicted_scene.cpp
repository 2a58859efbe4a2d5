#include "vkrun/predict/predicted_scene.h"

#include <algorithm>

#include "vkrun/cli/text.h"
#include "vkrun/view/scene_viewer.h"

namespace vkrun {

std::string trained_for(const splat_predictor_info& info, bool built_in, bool adapted) {
    const std::string category = info.category;
    std::string text = category.empty() ? "objects of a category that the weights do not name"
                       : built_in       ? "procedural " + category
                                        : category;
    if (adapted) text += ", changed by the adapters";
    text += format(", pictures of %u x %u pixels", info.resolution, info.resolution);
    if (info.fov_degrees > 0) text += format(", %.0f degrees across", info.fov_degrees);
    const float* const rgb = info.background;
    const bool white = rgb[0] > 0.99F && rgb[1] > 0.99F && rgb[2] > 0.99F;
    return text + (white ? ", white behind the object" : ", black behind the object");
}

void add_predicted_scene(HtmlPage& page, splat_scene scene, const std::string& name,
                         const splat_predictor_info& info,
                         const std::vector<splat_camera>& cameras) {
    ViewerOptions viewer;
    viewer.name = name;
    viewer.file = name + ".ply";
    viewer.cameras.assign(cameras.begin(), cameras.begin() + info.views);
    const std::size_t novel = cameras.size() - info.views;
    for (std::size_t i = 0; i < std::min<std::size_t>(4, novel); ++i)  // from all sides
        viewer.cameras.push_back(cameras[info.views + i * novel / 4]);
    viewer.instead = "The pictures show it.";
    std::copy_n(info.background, 3, viewer.background);
    up_of(std::vector(cameras.begin() + info.views, cameras.end()), viewer.up);
    viewer.turning = true;
    add_viewer(page, scene, viewer);
}

}  // namespace vkrun
