#pragma once

#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/cli/json.h"

namespace vkrun {

/// What became of an input: its scene, and what draws it.
struct Predicted {
    Scene scene;
    std::vector<splat_camera>
        cameras;                ///< the input views first; then, with a truth, the novel ones
    std::vector<float> inputs;  ///< [n,3,R,R]
    std::vector<float> truths;  ///< [n,3,R,R] of all views; empty without
    Evaluator evaluator;        ///< with truths
    std::string name;
    Json photo;
    std::vector<std::string> warnings;
    double predict_ms = 0;
    std::uint64_t faint = 0, not_finite = 0;  ///< Gaussians that were left out
};

/// Write OUT/input.png, view_NN.png, orbit.png and sheet.png of images [n,3,R,R], those of the input views first.
void write_prediction_pictures(const std::string& out, const splat_predictor_info& info,
                               const Predicted& task, const std::vector<float>& images);

/// Write OUT/report.html from the pictures and the facts of run_prediction. Returns its path.
std::string write_prediction_report(const std::string& out, const Predicted& task,
                                    const splat_predictor_info& info,
                                    const std::vector<splat_camera>& cameras, const Json& result);

/// The scene that turns and the sheet, for a page of several predictions.
void add_prediction(HtmlPage& page, const std::string& out, const Predicted& task,
                    const splat_predictor_info& info, const std::vector<splat_camera>& cameras);

}  // namespace vkrun
