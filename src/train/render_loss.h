#pragma once

#include <span>

#include "nn/executor.h"
#include "train/train_config.h"

namespace splat::train {

struct RenderLossDesc {
    std::uint32_t views = 1;
    std::uint32_t height = 1, width = 1;
    PixelLoss pixel_loss = PixelLoss::kL2;
    double pixel_weight = 1;
    double ssim_weight = 0;
};

/// Terms of a loss: means over views, pixels and channels.
struct LossTerms {
    double total = 0;
    double squared = 0;  ///< mean squared difference, whatever the loss is
    double pixel = 0;    ///< of the kind that is weighted
    double ssim = 0;     ///< structural similarity; 0 where it has no weight
};

/// How far rendered images are from their targets, with the gradient by the images:
///
///   loss = pixel_weight * mean |a - b|^p + ssim_weight * (1 - SSIM(a, b)),   p = 1 or 2
///
/// Images and their gradients are as the rasterizer has them, [V,H,W] quads of RGB and alpha; alpha has
/// no part in it.
///
/// Errors       the recorder's; those of Context::run
/// Precision    see ops/l1.h, ops/l2.h, ops/ssim.h
/// Determinism  bit-exact for any thread count
class RenderLoss {
  public:
    static Result<RenderLoss> create(vk::Context& context, const RenderLossDesc& desc);

    /// targets  [V,3,H,W]
    Status set_targets(std::span<const float> targets);

    /// Loss of `image`, and its gradient times `weight` into grad_image, overwritten.
    Status run(const vk::BufferView& image, const vk::BufferView& grad_image, float weight,
               LossTerms& terms);

  private:
    explicit RenderLoss(vk::Context& context, const RenderLossDesc& desc)
        : context_(&context), desc_(desc) {}
    Status allocate();
    Status record(const vk::BufferView& image, const vk::BufferView& grad_image);
    Status record_backward(vk::Recorder& recorder, const vk::BufferView& grad_image);

    vk::Context* context_;
    RenderLossDesc desc_;
    vk::Buffer rgb_, targets_, partial_;
    vk::Buffer losses_;   ///< squared, absolute, SSIM
    vk::Buffer weights_;  ///< gradients by the pixel loss and by SSIM
    vk::Buffer slopes_, rows_, grad_ssim_;
    vk::CommandList list_;
    vk::BufferView image_, grad_image_;
};

}  // namespace splat::train
