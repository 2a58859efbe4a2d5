#pragma once

#include <functional>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/eval/object_views.h"

namespace vkrun {

/// A scored object, for the page.
struct ObjectRow {
    std::uint32_t object = 0;
    std::string name;
    double psnr = 0, ssim = 0, conditioning_psnr = 0;
};

/// What the page shows of one object. A method that predicts no scene leaves it empty.
struct ShownObject {
    ObjectViews views;
    std::vector<float> images;  ///< [n,3,R,R], drawn
    Scene scene;
};

/// Write OUT/report.html: means, the objects' scores, and the worst, the median and the best object by PSNR of novel
/// views, as `show` gives them: a contact sheet, and the scene that turns on this background. Returns its path.
/// Throws a Failure.
std::string write_eval_report(const std::string& out, const Json& results,
                              const std::vector<std::pair<std::string, std::string>>& facts,
                              std::vector<ObjectRow> rows, const float* background,
                              const std::function<ShownObject(std::uint32_t object)>& show);

/// Targets above what was drawn: up to eight views, evenly spread.
void save_eval_sheet(const std::string& path, const ObjectViews& views,
                     const std::vector<float>& images);

}  // namespace vkrun
