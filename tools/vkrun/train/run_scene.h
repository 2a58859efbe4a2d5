#pragma once

#include <string>

#include "vkrun/cli/html_page.h"

namespace vkrun {

/// Predict the first validation object of a run with its best weights, and save the scene and the cameras of its
/// views as renders/best.ply and renders/best.json. On a device of its own, so that the training's figures are
/// its own. Throws a Failure.
void save_run_scene(const std::string& folder, const std::string& device);

/// Add that scene to a page; nothing if there is none. Throws a Failure.
void add_run_scene(HtmlPage& page, const std::string& folder);

}  // namespace vkrun
