#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/camera.h"
#include "triangles/mesh_on_device.h"

namespace splat::triangles {

/// What is drawn.
struct Wanted {
    bool color = true;
    bool alpha = true;
    bool depth = false;
    bool normal = false;
    bool albedo = false;
};

/// Views of one size, [views,height,width,channels], rows from the top. What is not wanted is empty.
///
/// color, albedo   RGB in sRGB, over the background: the mean over a pixel's samples in linear light. Over black,
///                 linear_of_srgb(color) + (1 - alpha) linear_of_srgb(b) is the linear picture over b
/// alpha           the share of a pixel's samples that see the mesh
/// depth           z of the camera, in the mesh's units, at the pixel's centre; 0 where nothing is
/// normal          of unit length in the camera's axes (OpenCV), on the side that is seen, at the pixel's centre; 0
///                 where nothing is. It is interpolated from the normals of the file; without those the face's
struct Images {
    std::uint32_t views = 0, width = 0, height = 0;
    std::vector<float> color = {};   ///< 3 channels
    std::vector<float> alpha = {};   ///< 1
    std::vector<float> depth = {};   ///< 1
    std::vector<float> normal = {};  ///< 3
    std::vector<float> albedo = {};  ///< 3, the base colour without light
};

struct RenderDesc {
    std::uint32_t samples = 4;                 ///< a side of a pixel: 1, 2, 4 or 8
    std::array<float, 3> background{1, 1, 1};  ///< sRGB, 0 to 1
    std::array<double, 3> up{0, 0, 1};  ///< where the sky is, in the mesh's axes: the light's axis
    double near_plane = 0;  ///< nearer points are not there; 0: 10^-3 of the box's diagonal
    bool light = true;      ///< false: color is albedo
    std::uint32_t most_triangles = 1U << 22U;  ///< tests: drawn at once
    std::uint64_t most_samples = 1ULL << 23U;  ///< tests: of the image's band that is drawn at once
};

/// Errors: kInvalidArgument, naming the field.
Status check_desc(const RenderDesc& desc);

/// Draw views of a mesh. All cameras have one size.
///
/// Coverage     exact for the corners rounded to 2^-21 to 2^-24 of what is in front of the camera: neighbours leave no
///              hole and share no sample, whether or not they share vertices in memory
/// Opacity      kMask: a sample is there from the cutoff on. kBlend: sample number s of n, in an order spread over the
///              pixel, is there where the opacity exceeds (s + 1/2) / n; a pixel's centre where it exceeds 1/2
/// Light        color = base (0.35 + 0.25 (0.5 + 0.5 n.up) + 0.4 max(0, n.l)), linear, with the direction l 45 degrees
///              above the horizon; n on the side that is seen
/// Errors       kInvalidArgument for the desc, a camera, cameras of several sizes; those of Context::run()
/// Precision    depth and normal 10^-5 relative, where faces are seen less than 80 degrees from the front; depth at
///              least 2^-22 of the box's diagonal, by the rounding of corners
/// Determinism  bit-exact, also over RenderDesc's limits for tests
/// Source       Olano and Greer 1997, doi:10.1145/258694.258723 (triangles without clipping)
Result<Images> render(vk::Context& context, const MeshOnDevice& mesh,
                      std::span<const scene::Camera> cameras, const RenderDesc& desc,
                      const Wanted& wanted);

/// Device memory of a mesh and of render(), about.
std::uint64_t device_bytes(const scene::TriangleMesh& mesh, std::uint32_t width,
                           std::uint32_t height, const RenderDesc& desc);

}  // namespace splat::triangles
