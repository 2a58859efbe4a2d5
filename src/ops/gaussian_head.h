#pragma once

#include "ops/op_table.h"

namespace splat::ops {

struct GaussianHeadDesc {
    std::uint32_t images = 1;  ///< batch * views
    std::uint32_t views = 1;   ///< per object; divides images
    std::uint32_t channels = 24;
    std::uint32_t pixels = 1;  ///< pixels per image
    std::uint32_t sh_degree = 1;
    float znear = 0;
    float zfar = 1;
    bool offset = true;      ///< three channels offset each point from its ray
    bool isotropic = false;  ///< the first scale serves for all three
    bool activate = true;    ///< false: opacities and scales straight from the network
};

/// Channels of the network's output: 1 + 3 offset + 1 + 3 + 4 + 3 + 9 sh_degree.
std::uint32_t gaussian_head_channels(const GaussianHeadDesc& desc);

/// Errors: kInvalidArgument for a degree above 1 or depths that are not finite with znear < zfar, kShape
/// for views that do not divide the images or another number of channels.
Status gaussian_head_check(const GaussianHeadDesc& desc);

/// Camera data of each image. Points are row vectors: [p, 1] view_to_world.
struct GaussianHeadCameras {
    vk::BufferView rays;           ///< [3,pixels]; z is 1
    vk::BufferView view_to_world;  ///< [images,4,4]
    vk::BufferView quaternion;     ///< [images,4] (w,x,y,z) of the same rotation
    vk::BufferView focal;          ///< [images,2] pixels: rays.xy are divided by it; or empty
    vk::BufferView origin;         ///< [images]: added to the depth; or empty
};

/// A batch of scenes, M = views * pixels Gaussians each, view by view and pixel by pixel.
struct GaussianHeadTensors {
    vk::BufferView means;      ///< [batch,M,3]
    vk::BufferView opacities;  ///< [batch,M,1]
    vk::BufferView scales;     ///< [batch,M,3]
    vk::BufferView rotations;  ///< [batch,M,4] (w,x,y,z)
    vk::BufferView sh;         ///< [batch,M,1 or 4,3], coefficient 0 first
};

/// Turn the network's output into one 3D Gaussian per pixel, in the world's frame.
///
///   p = ray * (sigmoid(depth) * (zfar - znear) + znear + origin) + offset
///   means = r.xyz / (r.w + 1e-10),  r = [p, 1] view_to_world
///   opacities = sigmoid(opacity)       scales = exp(scale)
///   rotations = quaternion * q / max(|q|, 1e-12)     (Hamilton product)
///   sh = dc, and the coefficients of degree 1 turned with the camera
///
/// net_out      [images,channels,H,W] float32 as quads: depth, [offset 3,] opacity, scale 3, rotation 4,
///              dc 3, [3 coefficients of 3 colours]
/// Errors       those of gaussian_head_check; nothing is recorded on error
/// Precision    a few roundings (tests/ops/gaussian_head_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Szymanowicz et al. 2024, arXiv:2312.13150, section 3, and its published code
Status gaussian_head_forward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                             const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                             const GaussianHeadTensors& gaussians);

/// The gradient with respect to the network's output, overwritten; cameras have none. Derived in
/// tests/ref/gaussian_head_ref.h; the rest as in the forward pass.
Status gaussian_head_backward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                              const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                              const GaussianHeadTensors& grads, const vk::BufferView& grad_net_out);

extern const OpRow kGaussianHeadRow;

}  // namespace splat::ops
