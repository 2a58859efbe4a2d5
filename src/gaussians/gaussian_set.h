#pragma once

#include "scene/activate.h"
#include "scene/gaussians.h"
#include "vk/context.h"

namespace splat::gaussians {

/// Floats of a Gaussian besides its colours.
inline constexpr std::uint32_t kGaussianFloats = 12;
/// Place of the first scale among them.
inline constexpr std::uint32_t kScaleAt = 4;

/// What a set holds of each Gaussian, and how many at most.
struct SetDesc {
    std::uint32_t gaussians = 0;
    std::uint32_t sh_degree = 0;
    bool direct_colors = false;  ///< colours are RGB, not spherical harmonics

    /// Floats of a Gaussian's colours: coefficients [(degree + 1)^2, 3] or one RGB.
    [[nodiscard]] std::uint32_t color_floats() const {
        return direct_colors ? 3 : 3 * scene::sh_coefficients(sh_degree);
    }
    [[nodiscard]] std::uint32_t color_quads() const { return (color_floats() + 3) / 4; }
    /// Bytes that the Gaussians take on a device.
    [[nodiscard]] std::uint64_t bytes() const {
        return std::uint64_t{4} * gaussians * (kGaussianFloats + 4 * color_quads());
    }
};

/// The arrays of an activated set, or of its gradients, as kernels read them.
struct SetViews {
    vk::BufferView gaussians;   ///< [N,3] quads: mean xyz, opacity; scale xyz, 0; rotation wxyz
    vk::BufferView colors;      ///< [N,color_quads] quads
    std::uint32_t count = 0;    ///< N; the views may be longer
    std::uint64_t version = 0;  ///< changes with the contents; 0: not known
    /// Bands above this degree hold zeros, so the kernels skip them.
    std::uint32_t sh_degree = scene::kMaxShDegree;

    /// True if both name the same memory for the same number of Gaussians.
    [[nodiscard]] bool same_memory(const SetViews& other) const {
        return count == other.count && gaussians.same_range(other.gaussians) &&
               colors.same_range(other.colors) && sh_degree == other.sh_degree;
    }
};

/// `count` elements from element `first` of a buffer with `stride` quads per element.
vk::BufferView slice(const vk::BufferView& view, std::uint64_t first, std::uint64_t count,
                     std::uint64_t stride);

/// `count` Gaussians from Gaussian `first` on.
SetViews part(const SetDesc& desc, const SetViews& views, std::uint32_t first, std::uint32_t count);

/// Device memory of a set, or of its gradients.
struct GaussianSet {
    SetDesc desc;  ///< gaussians is a capacity
    vk::Buffer gaussians, colors;
    std::uint32_t count = 0;  ///< Gaussians in use
    std::uint64_t version = 0;
    std::uint32_t sh_degree = scene::kMaxShDegree;

    [[nodiscard]] std::uint64_t bytes() const { return gaussians.bytes() + colors.bytes(); }
    [[nodiscard]] SetViews views() const {
        return {gaussians.range(), colors.range(), count, version, sh_degree};
    }
};

/// A version that no other contents of a set in this process have.
std::uint64_t next_version();

/// Memory for desc.gaussians Gaussians, all in use and filled with zeros. Errors: those of
/// Memory::allocate.
Result<GaussianSet> allocate_set(vk::Context& context, const SetDesc& desc);

/// Activate a scene of at most desc.gaussians Gaussians and copy it to `to`, with a new version. Bands
/// above desc.sh_degree are left out, bands that the scene lacks become zeros. Works in pieces to bound
/// the host memory.
///
/// Errors       those of Context::write
/// Precision    activated in float64, rounded once
Status upload(vk::Context& context, const scene::Gaussians& scene, GaussianSet& to);

/// Gaussians in the parameters of scenes, as files hold them.
struct Downloaded {
    scene::Gaussians gaussians;
    std::uint64_t not_finite = 0;  ///< left out: NaN, infinities, rotations of length 0
    std::uint64_t faint = 0;       ///< left out: opacity below the least
};

/// Read a set without direct colours back: all its Gaussians, or those of at least this opacity that an image can show. Scales
/// of 0, which exp() may give, become the least of float32, and are still drawn.
///
/// Errors       those of Context::read
/// Precision    the logarithm in float32; the logit in float64, rounded once
Result<Downloaded> download(vk::Context& context, const SetDesc& desc, const SetViews& from,
                            bool all, double least = scene::kLeastOpacity);

}  // namespace splat::gaussians
