#pragma once

#include <map>
#include <span>
#include <string_view>

#include "io/camera_set.h"

namespace splat::io::colmap {

/// A lens model of COLMAP: how many parameters it has, in this order.
struct Model {
    std::int32_t id;
    std::string_view name;
    std::size_t parameters;
    bool one_focal;                           ///< f cx cy instead of fx fy cx cy
    bool other_lens;                          ///< no pinhole, whatever its parameters
    std::span<const char* const> distortion;  ///< names of the parameters that follow
};

/// nullptr for a model that is not known.
const Model* find_model(std::int32_t id);
const Model* find_model(std::string_view name);

/// "PINHOLE, ..." for messages.
std::string supported_models();

struct Lens {
    const Model* model = nullptr;
    std::uint64_t width = 0;
    std::uint64_t height = 0;
    std::vector<double> parameters;
};

using Lenses = std::map<std::uint64_t, Lens>;

/// The line or record of an image.
struct Pose {
    std::uint64_t camera = 0;
    std::string name;
    double rotation[4] = {};  ///< w x y z
    double translation[3] = {};
};

/// Errors: kFormat for an unknown camera or one that is not valid; kUnsupported for
/// distortion and for other lenses.
Status add_camera(const Lenses& lenses, const Pose& pose, const CameraOptions& options,
                  CameraSet& set);

}  // namespace splat::io::colmap
