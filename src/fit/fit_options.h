#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/status.h"
#include "data/posed_photos.h"
#include "fit/schedule.h"
#include "run/task.h"

namespace splat::fit {

/// What a fit's steps depend on besides its photographs; what config.json of its run holds.
struct FitOptions {
    std::string data;                ///< folder of photographs and cameras
    std::string cameras = "auto";    ///< or "colmap", "transforms"
    std::string masks;               ///< a folder; empty: none
    std::string depth, normals;      ///< folders of maps; empty: none
    std::string init = "points";     ///< or "depth", "random", a file of a scene
    bool depth_is_distance = false;  ///< larger numbers of depth maps are farther, 0 is not known
    double depth_weight = 0.1, normal_weight = 0.05;  ///< factors of the losses against maps
    bool white_background = false;
    std::uint64_t downscale = 1;
    std::uint64_t test_every = 8;     ///< 0: all photographs are fitted
    std::uint64_t steps = 0;          ///< 0 until they are chosen
    double seconds = 0;               ///< 0: by steps
    std::uint64_t max_gaussians = 0;  ///< 0: by the length of the fit
    std::uint64_t sh_degree = 3;
    std::uint64_t seed = 0;
    std::uint64_t memory = 0;  ///< most bytes on the device; 0: what it has
    /// Most Gaussians for that, and what divides the sides of photographs, besides downscale; 0 until they are chosen.
    /// Given for a new fit, they bound what is chosen; both together, as a run's config.json has them, repeat its fit.
    std::uint64_t memory_gaussians = 0, memory_downscale = 0;
    bool refine_poses = false, refine_exposure = false;
    std::string strategy = "split";  ///< or "mcmc"
    Strategy tuning;                 ///< all but its `mcmc`
};

/// Options that a caller gives; the others are the defaults, or those of the run that is resumed.
struct FitDesc {
    std::optional<std::string> data, cameras, masks, depth, normals, init;
    std::optional<bool> white_background, refine_poses, refine_exposure;
    std::optional<std::uint64_t> downscale, test_every, steps, max_gaussians, sh_degree, seed,
        memory;
    std::optional<double> seconds;
    /// Options as NAME=VALUE, those above by the names of config.json and those that have only a name there.
    std::vector<std::string> values;
};

/// The options of a new fit; without steps, for 60 seconds. Errors: kInvalidArgument for a number out of its range, no
/// data, both steps and seconds, and for what is given but changes nothing, such as a weight of maps without maps.
Result<FitOptions> options_of(const FitDesc& given);

/// The options of a run that is resumed. Errors: kFormat for a text that is not the configuration of a fit;
/// kInvalidArgument for a given option that differs from the run's; only `memory` may.
Result<FitOptions> options_of_run(const run::ReadText& config, const FitDesc& given);

/// Text of a run's config.json.
std::string config_text(const FitOptions& options);

Strategy strategy_of(const FitOptions& options);

data::PosedPhotosOptions photos_of(const FitOptions& options);

}  // namespace splat::fit
