#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/view/scene_payload.h"

namespace vkrun {

/// Gaussians that a page holds unless the user wants others: about 130 MB with harmonics of degree 3.
constexpr std::uint64_t kPageGaussians = 1'500'000;

/// How a page shows a scene. The first camera is the view it begins with; digits go to the others.
struct ViewerOptions {
    std::string name, file = "scene.ply";  ///< name of the scene, and of the file that can be saved
    std::vector<splat_camera> cameras;     ///< at least one; see view_numbers()
    std::vector<std::string> stills;       ///< PNG files, for browsers that cannot draw
    std::string instead;                   ///< for those without stills: a sentence
    float background[3] = {0, 0, 0};
    double up[3] = {0, -1, 0};  ///< axis that it turns around
    bool turning = false;       ///< by itself, until it is touched
    bool full_window = false;
    std::optional<std::uint32_t> drawn_as;  ///< SPLAT_DRAWN_ bits; default: the scene's
};

/// What a page got of a scene.
struct ViewerFacts {
    std::uint64_t gaussians = 0, faint = 0;  ///< shown, and too faint to be seen
    std::size_t views = 0;
    std::vector<std::string> notes;
};

/// Adds a view of a scene that turns to a page: WebGL2, from the page alone.
ViewerFacts add_viewer(HtmlPage& page, ScenePayload payload, const ViewerOptions& options);

/// The same with pack_scene(scene, kPageGaussians). Throws a Failure.
ViewerFacts add_viewer(HtmlPage& page, splat_scene scene, const ViewerOptions& options);

/// Numbers of the cameras that are views of a page: all, or six of more than nine, evenly spread.
std::vector<std::size_t> view_numbers(std::size_t cameras);

/// The mean of what is up in the images of cameras around an object, a unit vector; without a clear one 0, -1, 0.
void up_of(const std::vector<splat_camera>& cameras, double* up);

}  // namespace vkrun
