#pragma once

#include "ops/quads.h"

namespace splat::ops {

struct GaussianHeadDesc {
    std::uint32_t images = 1;  ///< objects times views
    std::uint32_t pixels = 1;  ///< per image
    std::uint32_t sh_degree = 1;
    bool offset = true;      ///< channels 1 to 3 are an offset of the mean
    bool isotropic = false;  ///< the first scale for all three axes
    bool activate = true;  ///< else opacities are logits and scales logarithms, as files hold them
    bool sh_transform = true;  ///< coefficients of degree 1 are turned into the world
    bool focals = false;       ///< rays are divided by each image's focal lengths
    bool distances = false;    ///< a plane of distances is added to the depth
    float znear = 0;
    float zfar = 1;
};

/// Channels of net_out: 1 depth, 3 offset (if any), 1 opacity, 3 scales, 4 rotation, 3 colour, and 9
/// of degree 1.
std::uint32_t gaussian_head_channels(const GaussianHeadDesc& desc);

/// Errors: kInvalidArgument for a degree beyond 1 or znear, zfar that are not finite.
Status gaussian_head_check(const GaussianHeadDesc& desc);

/// Cameras and planes of a call; what the descriptor does not ask for may be any view of 16 bytes or
/// more, unread.
struct GaussianHeadCameras {
    vk::BufferView rays;           ///< [3,H,W] directions of the pixels, z = 1
    vk::BufferView view_to_world;  ///< [images,4,4] for row vectors
    vk::BufferView quaternion;     ///< [images,4] w, x, y, z of the camera-to-world rotation
    vk::BufferView focal;          ///< [images,2] pixels
    vk::BufferView distance;       ///< [images,H,W] scene units
};

/// One Gaussian per pixel, row-major; pixels of image after image.
struct GaussianHeadOutputs {
    vk::BufferView means;      ///< [images*P,3]
    vk::BufferView opacities;  ///< [images*P,1]
    vk::BufferView scales;     ///< [images*P,3]
    vk::BufferView rotations;  ///< [images*P,4] w, x, y, z
    vk::BufferView sh;         ///< [images*P,K,3], K = 1 or 4, constant term first
};

/// From the network's channels to Gaussians in world space. With the channels named as above:
///
///   ray = (rays.x / focal.x, rays.y / focal.y, rays.z)
///   t = sigmoid(depth) (zfar - znear) + znear + distance
///   [X, w] = [ray t + offset, 1] view_to_world        means = X / (w + 1e-10)
///   opacities = sigmoid(opacity)                      scales = exp(scales)
///   rotations = quaternion * q / max(|q|, 1e-12)      (Hamilton product)
///   sh = (colour, coefficients T), T = V^T M V, M the upper left of view_to_world, V the axes
///   (-y, z, -x) of the degree-1 basis
///
/// net_out      [images,C,H,W] float32 as quads
/// Errors       those of gaussian_head_check; nothing is recorded on error
/// Precision    relative L2 2e-6 (tests/ops/gaussian_head_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Szymanowicz et al. 2024, arXiv:2312.13150, sections 4.1-4.3
Status gaussian_head_forward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                             const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                             const GaussianHeadOutputs& outputs);

/// Its gradient with respect to net_out, overwritten; cameras are constants. The rest as in the
/// forward pass.
Status gaussian_head_backward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                              const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                              const GaussianHeadOutputs& grads, const vk::BufferView& grad_net_out);

}  // namespace splat::ops
