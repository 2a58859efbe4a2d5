#pragma once

#include <cstdint>
#include <string>

namespace CLI {
class App;
}

namespace vkrun {

/// What 'vkrun eval' is told about a scene of Gaussians.
struct SceneEvalOptions {
    std::string masks, cameras = "auto";
    std::uint32_t downscale = 1, test_every = 8;
    double border = 0.1;
    bool white = false;
};

/// The options that only a scene has.
void add_scene_eval_options(CLI::App& command, SceneEvalOptions& options);

/// Score the scene on held-out photographs of the folder `data`, and write results.json, per_view.csv and report.html.
/// Returns the exit status. Throws a Failure.
int evaluate_scene(const std::string& path, const std::string& data, const std::string& out,
                   const SceneEvalOptions& options, const std::string& device, bool json);

}  // namespace vkrun
