#pragma once

#include <cstdint>
#include <string>

#include "core/rng.h"
#include "core/status.h"
#include "scene/camera.h"
#include "scene/vector.h"

/// Meshes seen by cameras, as objects of a data set. Host only: who draws is a function.
namespace splat::mesh_views {

/// kSrn: srn_<category>/<category>_<split>/<name>/ with intrinsics.txt, pose/, rgb/ and maps; kImages:
/// <split>/<name>/ with transforms.json, rgb/ and maps.
enum class Layout { kSrn, kImages };

/// Where cameras stand; all look at the origin. kSphere: at random around the object; kHemisphere: at random above
/// the horizon; of both, views of val and test are on a spiral (scene::spiral_direction()). kOrbit: at equal angles
/// on a circle, in all splits.
enum class Protocol { kSphere, kHemisphere, kOrbit };

/// What is behind the object, in sRGB: white, black, gray (0.5), a random colour for each view, or a gradient
/// between two in a random direction.
enum class Background { kWhite, kBlack, kGray, kPlain, kGradient };

/// The upward axis of the mesh's file. In the data set z is up: y-up meshes are turned, so that z becomes x, x
/// becomes y and y becomes z.
enum class Up { kY, kZ };

inline constexpr double kDegree = 0.017453292519943295;

struct ViewsDesc {
    std::string path;
    Layout layout = Layout::kSrn;
    std::string category = "objects";
    std::string split = "train";
    std::string name;  ///< object's name; with the seed it decides all that is random
    std::string
        prepared;  ///< words on how meshes were made ready, which all objects have in common
    std::uint64_t seed = 0;
    std::uint32_t size = 128;
    std::uint32_t train_views = 50;
    std::uint32_t test_views = 251;  ///< views of an object of val and test
    std::uint32_t samples = 4;       ///< a side of each pixel; only told here
    std::uint32_t points = 10000;    ///< on the surface; 0: none
    bool depth = true, normal = true, mask = true, albedo = false;
    Protocol protocol = Protocol::kSphere;
    Background background = Background::kWhite;
    Up up = Up::kZ;
    double distance = 1.3;
    double fov_x = 0;                 ///< radians; 0: that of SRN's data, 131.25 pixels of 128
    double elevation = 20 * kDegree;  ///< height of an orbit above the horizon
    /// Radians: each camera rolls, and aims beside the origin to the right and down, by up to this angle, and
    /// stands by up to this share (1 degree: 1 %) nearer or farther.
    double jitter = 0;
    double exposure =
        0;  ///< stops: the object's light is multiplied by 2^e, e up to this away from 0

    [[nodiscard]] std::uint32_t views() const {
        return split == "train" ? train_views : test_views;
    }
};

/// Errors: kInvalidArgument, naming the field; kUnsupported for a size above 2048.
Status check_desc(const ViewsDesc& desc);

/// All values that decide the bytes of an object besides its mesh, as the data set's folder keeps them.
std::string values_text(const ViewsDesc& desc);

/// What a random number is for.
enum class Chance : std::uint32_t { kPlace, kJitter, kLook };

/// Random numbers of a view of the object.
Random random_of(const ViewsDesc& desc, Chance what, std::uint32_t view);

/// One seed for all of an object.
std::uint64_t seed_of(const ViewsDesc& desc);

/// The camera of a view in the world of the data set.
scene::Camera view_camera(const ViewsDesc& desc, std::uint32_t view);

/// The same camera in the axes of the mesh.
scene::Camera in_mesh_axes(const scene::Camera& camera, Up up);

/// A point or direction of the mesh in the world of the data set.
scene::Vec3 in_world(const scene::Vec3& of_mesh, Up up);

}  // namespace splat::mesh_views
