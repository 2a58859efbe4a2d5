#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace vkrun {

/// What the command line of 'vkrun render' says.
struct RenderOptions {
    std::string scene, cameras, out;
    std::string file;  ///< path of the only image, if --out names it; else `out` is a folder
    std::uint32_t orbit = 0;
    std::string path;                 ///< cameras that a path goes through; empty: none
    std::uint32_t frames = 120;       ///< images of the path
    bool closed = false;              ///< the path returns to where it begins
    std::optional<double> elevation;  ///< degrees
    std::optional<double> distance;   ///< scene units
    std::optional<float> near_plane;  ///< scene units
    std::optional<float> far_plane;   ///< scene units
    std::string size;
    bool ignore_distortion = false;
    bool lenient = false;
    std::string format = "png";
    std::string convention = "3dgs";
    bool antialiased = false;
    std::vector<std::string> drawn_as = {"file"};
    std::vector<float> background = {0, 0, 0};
    std::vector<std::string> outputs = {"rgb"};
    bool animate = false;
    std::string animation;  ///< file
    std::string page;       ///< file; empty: none
    bool overwrite = false;
    std::string device = "best";
    std::uint64_t memory = 0;  ///< bytes that may be taken; 0: what the system has available
    bool json = false;
};

void add_render_options(CLI::App& command, RenderOptions& options);

/// Throws a usage Failure for options that have no effect together, or that are out of range.
void check_render_options(const RenderOptions& options);

/// Split --out, and choose where the animation goes. Throws a usage Failure if --out names a file, but there are more
/// images than one.
void place_images(RenderOptions& options, std::size_t images);

}  // namespace vkrun
