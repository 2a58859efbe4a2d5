#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/shown.h"
#include "core/status.h"
#include "scene/camera.h"

namespace splat::io {

/// Cameras of a file.
/// Maps of a camera's image, as a transforms.json names them; empty: none.
struct CameraMaps {
    std::string mask;   ///< mask_path
    std::string depth;  ///< depth_file_path: distances
};

struct CameraSet {
    std::vector<scene::Camera> cameras;  ///< valid; `name` is the image's path in the file
    std::vector<CameraMaps> maps;        ///< maps of each camera of a transforms.json
    /// Names of the cameras of "train", "val" and "test" in a transforms.json that divides its frames.
    std::map<std::string, std::vector<std::string>> splits;
    std::vector<std::string> warnings;  ///< what is ignored
};

struct CameraOptions {
    /// Read cameras with lens distortion, and of other models, as if they were pinholes, with a warning. Otherwise they
    /// are an error, because images would not match.
    bool ignore_distortion = false;
    std::uint64_t max_cameras = 1ULL << 20;  ///< more are refused
    /// Focal length in pixels of the image that a camera names, for a transforms.json that gives none; 0: not known.
    std::function<double(const std::string& image)> focal = {};
};

/// Turns what makes a lens other than a pinhole into a warning or an error, by the options.
inline Status note_lens(const std::string& camera, const std::string& what,
                        const CameraOptions& options, CameraSet& set) {
    const std::string found = "camera '" + shown(camera) + "': " + what;
    if (!options.ignore_distortion)
        return error(Code::kUnsupported,
                     "%s, only pinhole cameras are supported; undistort the images, or, where "
                     "cameras alone are read, ignore it (SPLAT_CAMERA_IGNORE_DISTORTION, "
                     "--ignore-distortion)",
                     found.c_str());
    set.warnings.push_back(found + " is ignored");
    return {};
}

/// The same of a distortion parameter that is not zero.
inline Status note_distortion(const std::string& camera, const char* parameter, double value,
                              const CameraOptions& options, CameraSet& set) {
    if (value == 0) return {};
    return note_lens(camera, format("distortion %s = %g", parameter, value), options, set);
}

}  // namespace splat::io
