#pragma once

#include "gaussians/gaussian_set.h"
#include "ops/op_table.h"
#include "params/gaussian_head_params.h"

namespace splat::ops {

/// Gaussians of a pixel: kernels are tested with no more.
inline constexpr std::uint32_t kMostGaussiansPerPixel = 4;

struct GaussianHeadDesc {
    std::uint32_t images = 1;  ///< batch * views
    std::uint32_t views = 1;   ///< per object; divides images
    std::uint32_t channels = 24;
    std::uint32_t pixels = 1;  ///< pixels per image
    HeadLayout layout;
};

/// Errors: kInvalidArgument for a layout with values out of range or that contradict each other, kShape for
/// views that do not divide the images or another number of channels.
Status gaussian_head_check(const GaussianHeadDesc& desc);

/// The operator's attributes for a head.
std::vector<JsonScalar> gaussian_head_attributes(const HeadForm& form, std::uint32_t views);

/// Camera data of each image. Points are row vectors: [p, 1] view_to_world.
struct GaussianHeadCameras {
    vk::BufferView rays;           ///< [3,pixels]; z is 1
    vk::BufferView view_to_world;  ///< [images,4,4]
    vk::BufferView quaternion;     ///< [images,4] (w,x,y,z) of the same rotation
    vk::BufferView focal;          ///< [images,2] pixels: rays.xy are divided by it; or empty
    /// [images]: added to the depth; or empty. With kHeadInputDepth [images,pixels]: the depth.
    vk::BufferView origin;
};

/// Turn the network's output into 3D Gaussians in the world's frame.
///
///   p = ray * (sigmoid(depth) * (most - least) + least + origin) + point
///   means = r.xyz / (r.w + 1e-10),  r = [p, 1] view_to_world
///   opacities and scales: activated as the layout says
///   rotations = quaternion * q / max(|q|, 1e-12)     (Hamilton product)
///   sh = colour, and the coefficients of degree 1 turned with the camera
///
/// With kHeadInputDepth p = ray * origin + point. With kHeadBox means = clamp(point, least, most), and neither
/// rotations nor coefficients are turned. Direct colours c become sh = (c - 1/2) / kSh0.
///
/// net_out      [images,channels,H,W] float32 as quads: the layout's blocks
/// set          a batch of scenes, each view by view and pixel by pixel
/// Errors       those of gaussian_head_check; kInvalidArgument for kHeadInputDepth without `origin`; nothing
///              is recorded on error
/// Precision    a few roundings (tests/ops/gaussian_head_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Szymanowicz et al. 2024, arXiv:2312.13150, section 3, and its published code
Status gaussian_head_forward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                             const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                             const gaussians::SetViews& set);

/// The gradient with respect to the network's output, overwritten; cameras have none. Derived in
/// tests/ref/gaussian_head_ref.h; the rest as in the forward pass.
Status gaussian_head_backward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                              const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                              const gaussians::SetViews& grads, const vk::BufferView& grad_net_out);

extern const OpRow kGaussianHeadRow;

/// The operator with the set itself as its outputs, for graphs that draw it: gaussians [batch,M,12] and colors
/// [batch,M,4 color_quads].
const OpRow& gaussian_set_row();

}  // namespace splat::ops
