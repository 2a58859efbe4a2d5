#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "vk/recorder.h"

/// The loss that fits a drawn view to a photograph, in one pass with its gradient.
namespace splat::fit {

/// Affine exposure of a view: red, green and blue, each three gains and an offset, of which a colour c of the image
/// becomes gains c + offset.
using Exposure = std::array<float, 12>;
inline constexpr Exposure kNoExposure = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// One view.
struct PhotoLossDesc {
    std::uint32_t width = 1;
    std::uint32_t height = 1;
    double ssim_weight = 0.2;  ///< s, from 0 to 1
    std::uint32_t view = 0;    ///< which of the images
    std::optional<Exposure> exposure =
        {};  ///< the photograph is compared with the image through it
};

struct PhotoLossViews {
    vk::BufferView
        image;  ///< [V,H,W] quads: red, green, blue and alpha, as the rasterizer draws them
    vk::BufferView
        truth;  ///< [H,W] uint32: R | G << 8 | B << 16 | A << 24; A 255: valid, anything else: not
    vk::BufferView workspace;  ///< photo_loss_workspace
    vk::BufferView
        grad_image;  ///< [V,H,W] quads, those of the view are overwritten; alpha's gradient is 0
    vk::BufferView partial;  ///< photo_loss_partial, overwritten: read it with photo_loss_sums
};

/// Sums over the valid pixels and three channels, in float64.
struct PhotoLossSums {
    double absolute = 0;                   ///< |a - t|
    double dissimilarity = 0;              ///< 1 - SSIM
    double squared = 0;                    ///< (a - t)^2
    std::array<double, 12> exposure = {};  ///< gradient of the loss times `share`, if there is one

    /// The loss of a view with `valid` pixels; 0 if none is valid.
    [[nodiscard]] double loss(const PhotoLossDesc& desc, std::uint32_t valid) const;
    /// Mean squared error, from which PSNR follows.
    [[nodiscard]] double squared_error(std::uint32_t valid) const;
};

/// Bytes of the workspace and of the partial sums, for the kernels in use.
std::uint64_t photo_loss_workspace(const vk::Recorder& recorder, const PhotoLossDesc& desc);
std::uint64_t photo_loss_partial(const vk::Recorder& recorder, const PhotoLossDesc& desc);

/// Loss of a view and its gradient. With m the mask, M its sum and t the truth of 0 to 1,
///
///   loss = (1 - s) sum m |a - t| / (3 M) + s sum m (1 - SSIM(m a, m t)) / (3 M)
///
/// where a is the image, or the image through its exposure, and SSIM has a Gaussian window of 11x11 pixels and standard
/// deviation 1.5, C1 = 0.01^2, C2 = 0.03^2, and zeros outside the image. The image counts as 0 where the mask is 0,
/// even if it is NaN there. t is a byte times the float32 1 / 255.
///
/// valid        M, a fact of the truth; 0: the gradient is 0
/// share        factor of the gradient, such as 1 / views of a step
/// Errors       kInvalidArgument (a size of 0, a weight outside 0 to 1), kShape (a view that is too small), the
///              recorder's
/// Precision    gradient 1e-6 of its largest values, in flat regions 1e-4 (ssim.h); a NaN in a valid pixel makes
///              sum `absolute` NaN
/// Determinism  bit-exact for any thread count
/// Source       Kerbl et al. 2023, doi:10.1145/3592433, eq. 7; SSIM: Wang et al. 2004, doi:10.1109/TIP.2003.819861
Status photo_loss(vk::Recorder& recorder, const PhotoLossDesc& desc, const PhotoLossViews& views,
                  std::uint32_t valid, double share);

/// What photo_loss left in `partial`, downloaded; the sum has a fixed order.
PhotoLossSums photo_loss_sums(const vk::Recorder& recorder, const PhotoLossDesc& desc,
                              std::span<const float> partial);

}  // namespace splat::fit
