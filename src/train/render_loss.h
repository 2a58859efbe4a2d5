#pragma once

#include <span>

#include "config/train_config.h"
#include "model/lpips_net.h"
#include "nn/executor.h"

namespace splat::train {

struct RenderLossDesc {
    std::uint32_t views = 1;
    std::uint32_t height = 1, width = 1;
    config::PixelLoss pixel_loss = config::PixelLoss::kL2;
    double ssim_weight = 0;
    double edge_weight = 0;
    config::EdgeFilter edge_filter = config::EdgeFilter::kSobel;
    bool edge_weights = false;  ///< the caller fills RenderLoss::edge_weights() before each run
    /// Weights of LPIPS, see model::LpipsNet; only create() reads them. Empty: no LPIPS.
    std::span<const io::NamedTensors* const> lpips;
    model::Precision precision = model::Precision::kBalanced;  ///< precision of the LPIPS network
};

/// Terms of a loss: means over views, pixels and channels.
struct LossTerms {
    double total = 0;
    double squared = 0;  ///< mean squared difference, for any loss
    double pixel = 0;    ///< the loss in use, L1 or L2
    double ssim = 0;     ///< structural similarity; 0 without weight
    double edge = 0;     ///< difference of edges; 0 without weight
    double lpips = 0;    ///< 0 without weight
};

/// Distance of rendered images from their targets, with the gradient with respect to the images:
///
///   loss = (1 - s - l) mean |a - b|^p + s (1 - SSIM(a, b)) + l mean over views of LPIPS(a, b)
///        + e edge_loss(a, b),   p = 1 or 2, s = ssim_weight, l = lpips_weight, e = edge_weight
///
/// Images and their gradients are as in the rasterizer, [V,H,W] quads of RGB and alpha; alpha is ignored.
///
/// Errors       the recorder's; those of Context::run and of model::LpipsNet
/// Precision    see losses/l1.h, l2.h, ssim.h and edge_loss.h of ops, model/lpips_net.h
/// Determinism  bit-exact for any thread count
class RenderLoss {
  public:
    static Result<RenderLoss> create(vk::Context& context, const RenderLossDesc& desc);

    /// targets  [V,3,H,W]
    Status set_targets(std::span<const float> targets);

    /// [V,1,H,W] as quads: factors of the differences of edges.
    [[nodiscard]] const vk::BufferView& edge_weights() const { return edge_weights_.range(); }

    /// Compute the loss of `image`, and write its gradient times `share` into grad_image. A lpips_weight
    /// other than 0 needs the weights of LPIPS.
    Status run(const vk::BufferView& image, const vk::BufferView& grad_image, float share,
               double lpips_weight, LossTerms& terms);

  private:
    explicit RenderLoss(vk::Context& context, const RenderLossDesc& desc)
        : context_(&context), desc_(desc) {}
    Status allocate();
    Status record(const vk::BufferView& image, const vk::BufferView& grad_image);
    Status record_backward(vk::Recorder& recorder, const vk::BufferView& grad_image);
    Status record_lpips(const vk::BufferView& grad_image);
    Status run_lpips(double weight, LossTerms& terms);

    vk::Context* context_;
    RenderLossDesc desc_;
    vk::Buffer rgb_, targets_, partial_;
    vk::Buffer losses_;   ///< squared, absolute, SSIM, edges
    vk::Buffer weights_;  ///< factors of the pixel loss, of SSIM and of edges
    vk::Buffer slopes_, rows_;
    vk::Buffer edge_slopes_, edge_weights_;
    vk::Buffer grad_term_;  ///< gradient of SSIM, then of edges
    std::unique_ptr<model::LpipsNet> lpips_;
    vk::Buffer grad_lpips_;
    vk::CommandList list_, to_lpips_, from_lpips_;
    vk::BufferView image_, grad_image_;
};

}  // namespace splat::train
