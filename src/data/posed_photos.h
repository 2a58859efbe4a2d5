#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/status.h"
#include "scene/camera.h"
#include "scene/lens.h"
#include "scene/vector.h"

namespace splat::data {

/// A photograph as a pinhole camera sees it.
struct PosedPhoto {
    std::string name;       ///< the one in the file of cameras
    scene::Camera camera;   ///< a pinhole of this photograph's size
    bool held_out = false;  ///< for scores, not to fit
    std::uint32_t width = 0, height = 0;
    /// [height,width], R | G << 8 | B << 16 | 255 << 24; 0 where there is no source or the mask leaves it out.
    std::vector<std::uint32_t> pixels;
    /// [height,width] relative inverse depth of its map from 0, the farthest, to 1; NaN: not known. Empty: no map.
    std::vector<float> nearness = {};
    /// [height,width] like pixels: (n + 1) / 2 of the normal in the camera's axes. Empty: no map.
    std::vector<std::uint32_t> normals = {};
};

/// Photographs of one scene, by name. Sizes differ where cameras do.
struct PosedPhotos {
    std::vector<PosedPhoto> photos;
    std::vector<scene::Vec3> points;  ///< finite, in the cameras' frame; may be none
    /// RGB of each point; gray where the file has none.
    std::vector<std::array<std::uint8_t, 3>> colors;
    /// Sentences: which cameras and pictures are taken, what is undone or left out.
    std::vector<std::string> notices;
};

struct PosedPhotosOptions {
    enum class Cameras {
        kAuto,  ///< a COLMAP model where there is one, else transforms.json
        kColmap,
        kTransforms,  ///< transforms.json, else transforms_train.json and its like
    };
    Cameras cameras = Cameras::kAuto;
    std::uint32_t downscale = 1;  ///< divides the sides; 0 is 1
    /// Holds out each so many by name, first included; 0: none, not even the data's own split.
    std::uint32_t test_every = 8;
    /// A folder of masks, named like the photographs; 0 leaves a pixel out. Empty: none.
    std::string masks = {};
    bool white_background = false;  ///< under transparent pictures; else only opaque pixels count
    /// Folders of maps for the photographs to fit, of their stored size and named like them. Empty: none.
    std::string depth = {}, normals = {};
    bool depth_is_distance = false;  ///< larger is farther, 0 not known; else larger is nearer
    /// Called with the number of photographs done and of all, on any thread; an error ends the call.
    std::function<Status(std::size_t done, std::size_t count)> progress = {};
};

/// Reads the photographs of a folder with their cameras: a COLMAP model (io::kColmapFolders), a transforms.json, or
/// transforms_{train,val,test}.json, each as in options.cameras.
///
/// Photographs are those of images_D/ for a downscale of D, if it has all of them; else those of images/ or the folder,
/// undistorted, then reduced by D as in reduce(). Held out are the photographs of the data's own split, test before
/// val, else every test_every-th. Masks are those of options.masks (NAME.png, or NAME.jpg.png as COLMAP has them), else
/// of mask_path, together with the alpha of the photographs. Maps of depth and normals are undistorted and reduced as
/// the photographs are (read_photo_maps()).
///
/// Points are those of the COLMAP model, or of ply_file_path. Those that are not finite, or more than 10,000 times
/// farther away than the cameras are from each other, are left out.
///
/// Errors       kNotFound for a folder without cameras, missing photographs, masks and maps; kFormat, kUnsupported and
///              kIo as the readers of cameras and images; kFormat for a photograph of another size than its camera,
///              masks that leave nothing, maps as read_photo_maps(), photographs that are equal or of one colour;
///              kInvalidArgument for options, and fewer than two photographs to fit
/// Determinism  the same bits for any number of threads
Result<PosedPhotos> load_posed_photos(const std::string& folder, const PosedPhotosOptions& options);

/// The photograph as a pinhole camera of the same fx, fy, cx and cy sees it, then reduced as in reduce(). A pixel is
/// bilinear between the four around the place where the lens puts it, and is there if they are. So are its maps.
///
/// Precision    float32 from the samples to the mean, rounded once; places are float64
PosedPhoto undistort(const PosedPhoto& photo, const scene::Lens& lens, std::uint32_t factor = 1);

/// Means over blocks of factor x factor pixels, without the columns and rows that are too many, left out on both sides.
/// A pixel is there if all of its block are, and so are its maps'. The factor is at most the shorter side.
PosedPhoto reduce(const PosedPhoto& photo, std::uint32_t factor);

}  // namespace splat::data
