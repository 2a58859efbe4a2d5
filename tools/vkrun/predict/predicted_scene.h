#pragma once

#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/html_page.h"

namespace vkrun {

/// "procedural cars, pictures of 64 x 64 pixels, 52 degrees across, white behind the object".
std::string trained_for(const splat_predictor_info& info, bool built_in, bool adapted);

/// Add a prediction that turns to a page. `cameras` begin with the input views. Throws a Failure.
void add_predicted_scene(HtmlPage& page, splat_scene scene, const std::string& name,
                         const splat_predictor_info& info,
                         const std::vector<splat_camera>& cameras);

}  // namespace vkrun
