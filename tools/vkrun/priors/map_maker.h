#pragma once

#include <splat.h>

#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/priors/depth_source.h"
#include "vkrun/priors/edge_maps.h"
#include "vkrun/priors/map_jobs.h"

namespace vkrun {

/// Planes of depth maps.
struct PlaneOptions {
    bool use = false;
    bool normals = false;  ///< take normal maps, else differences of the depth
    double degrees = 15, offset = 0.02, least = 0.005;  ///< splat_planes_desc
};

struct MapOptions {
    std::string map;  ///< "depth", "normal", "mask", "edges", "plane"
    std::string in, out;
    std::string model, preset, runtime;
    std::string format = "png";  ///< "png", "png16", "npy"
    std::string shard;
    std::uint32_t batch = 4;
    std::uint32_t threads = 0, tokens = 0;
    std::string device = "best";         ///< device of models that are weights
    std::vector<std::string> of_models;  ///< given ones of --runtime, --tokens, --device
    DepthOptions depth;                  ///< normals without a model, edges of depth maps
    EdgeOptions edges;
    PlaneOptions planes;
    bool all = false;  ///< every map that the model makes
    bool overwrite = false;
};

/// What was done.
struct MapReport {
    std::string preset, licence, model;  ///< empty without a model
    std::vector<std::string> maps;
    std::size_t made = 0, kept = 0, failed = 0;  ///< pictures
    double seconds = 0;
};

/// A picture as bytes [height,width,channels]. Throws a Failure of bad data.
struct LoadedPicture {
    std::vector<std::uint8_t> bytes;
    splat_image image{};  ///< view of `bytes`
};
LoadedPicture load_picture(const std::string& path);

/// A model to load; empty texts and 0 are defaults.
struct ModelSource {
    std::string model, preset, runtime;
    std::uint32_t threads = 0, tokens = 0;
    bool numbers = false;         ///< SPLAT_PRIOR_MODEL_NUMBERS
    std::string device = "best";  ///< device of weights, if `on` is none
    splat_device on = nullptr;
};

/// Load a model; weights by a device. Throws a Failure: of usage for a preset, of bad data for the rest.
PriorModel load_prior_model(const ModelSource& source);

/// Make the maps of all pictures, or of those that lack one. Pictures that cannot be read, or have no object, are named
/// on standard error and counted. Throws a Failure for other errors.
MapReport make_maps(const MapOptions& options);

}  // namespace vkrun
