#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/status.h"
#include "scene/camera.h"
#include "scene/lens.h"

namespace splat::io {

/// Maps of a camera's image, as a transforms.json names them; empty: none.
struct CameraMaps {
    std::string mask;   ///< mask_path
    std::string depth;  ///< depth_file_path: distances
};

/// What of a lens is ignored, and of how many cameras.
struct IgnoredLens {
    std::string what;    ///< the ignored value of the first camera, "distortion k1 = 0.1"
    std::string camera;  ///< the name of the first
    std::set<std::size_t> cameras;
};

/// Cameras of a file.
struct CameraSet {
    std::vector<scene::Camera> cameras;  ///< valid; `name` is the image's path in the file
    std::vector<scene::Lens> lenses;     ///< one for each camera, also where it is ignored
    std::vector<CameraMaps> maps;        ///< maps of each camera of a transforms.json
    std::string points;                  ///< ply_file_path of a transforms.json; empty: none
    /// Names of the cameras of "train", "val" and "test" in a transforms.json that divides its frames.
    std::map<std::string, std::vector<std::string>> splits;
    std::map<std::string, IgnoredLens> ignored;  ///< by what it is: "k1"
    std::vector<std::string> warnings;           ///< what is ignored
};

struct CameraOptions {
    /// Read cameras with lens distortion, and of other models, as if they were pinholes, with a warning. Otherwise they
    /// are an error, because images would not match.
    bool ignore_distortion = false;
    bool may_ignore = false;  ///< whoever reads them can ask for that
    bool keep_lens = false;   ///< read any lens that CameraSet::lenses can hold, without a warning
    std::uint64_t max_cameras = 1ULL << 20;  ///< more are refused
    /// Focal length in pixels of the image that a camera names, for a transforms.json that gives none; 0: not known.
    std::function<double(const std::string& image)> focal = {};
};

/// Turns what makes a lens other than a pinhole into something ignored or an error, by the options. `kind` is one of
/// all cameras. The camera is the next one of the set.
Status note_lens(const std::string& camera, const std::string& kind, const std::string& what,
                 const CameraOptions& options, CameraSet& set);

/// The same of a distortion parameter that is not zero.
Status note_distortion(const std::string& camera, const char* parameter, double value,
                       const CameraOptions& options, CameraSet& set);

/// One warning of all that is ignored.
void warn_of_ignored(CameraSet& set);

}  // namespace splat::io
