#pragma once

#include <filesystem>
#include <vector>

#include "core/os/path.h"
#include "core/status.h"
#include "io/image.h"
#include "scene/vector.h"

// The views of DISN's renders: their cameras, and whether the object of a hard view moved. Source: the scripts of
// ShapenetRender_more_variation.
namespace splat::data::disn {

inline constexpr const char* kMetadata = "rendering_metadata.txt";

/// A line of rendering_metadata.txt.
struct View {
    double azimuth = 0, elevation = 0;  ///< radians
    double distance = 0;                ///< from the origin to the camera
    double focal = 0;                   ///< in widths
    scene::Vec3 shift{};                ///< where the object is moved, in the axes of its .obj
};

/// The lines of a file. Errors: as read_file(); kFormat, naming the line.
Result<std::vector<View>> read_views(const std::filesystem::path& path);

/// Whether the objects of views that say so are moved.
enum class Shift { kNone, kMoved };

/// A camera in the axes of the .obj, whose object stays where it is: where it is moved, the camera is, the other way.
struct Camera {
    scene::Mat3 turn{1};  ///< columns: right, down and forward of the camera
    scene::Vec3 place{};
    double focal = 0;
};
Camera camera_of(const View& view, Shift shift);

/// Camera-to-world, row-major, with OpenCV axes. y points up in the .obj, z in our world: x, y, z become x, -z, y.
scene::Mat4 pose_of(const Camera& camera);

/// Planar depth of each pixel in units of the object's diagonal; 0: not known. The files have 0.7 + v / 255 / 1.4, and
/// 255 for all that is farther, as the background is. Opacity of the image tells the object: that of the depth varies.
struct Depth {
    std::uint32_t side = 0;
    std::vector<float> z;
    std::vector<bool> object;
};
Depth depth_of(const io::Image& stored, const io::Image& image);

/// Finds out whether objects moved. The script that drew the views says how it moved them, but moved only the last of
/// their parts: points that a view sees must be where the next one sees them.
class ShiftTest {
  public:
    /// The next view, in their order.
    void add(const View& view, Depth depth);

    /// Three pairs of views that show enough are enough.
    [[nodiscard]] bool is_done() const { return pairs_ >= 3; }

    /// Errors: kFormat, naming the object, where no pair shows enough, or neither choice fits.
    Result<Shift> result(const std::string& object);

  private:
    View last_;
    Depth before_;
    std::size_t pairs_ = 0;
    std::vector<double> differences_[2];  ///< by Shift: distances in depth
};

}  // namespace splat::data::disn
