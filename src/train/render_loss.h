#pragma once

#include <array>
#include <span>
#include <string_view>

#include "config/train_config.h"
#include "model/lpips_net.h"
#include "nn/executor.h"
#include "ops/op_table.h"

namespace splat::train {

using config::kLossTerms;
using config::LossTerm;

struct RenderLossDesc {
    std::uint32_t views = 1;
    std::uint32_t height = 1, width = 1;
    vk::BufferView image, grad_image;  ///< [V,H,W] quads of RGB and alpha; they outlive the loss
    config::TrainConfig
        config;  ///< pixel_loss, the weights of kLossTerms and their attributes, precision
    bool pixel_weights = false;  ///< the caller fills RenderLoss::pixel_weights() before each run
    /// Weights of LPIPS, see model::LpipsNet; only create() reads them. Empty: no LPIPS.
    std::span<const io::NamedTensors* const> lpips;
};

/// Terms of a loss: means over views, pixels and channels.
struct LossTerms {
    double total = 0;
    double squared = 0;                                  ///< mean squared difference, for any loss
    double pixel = 0;                                    ///< the loss in use, L1 or L2
    std::array<double, std::size(kLossTerms)> values{};  ///< values of kLossTerms; 0 without weight

    [[nodiscard]] double of(std::string_view name) const;
    void add(const LossTerms& other, double share);
};

/// Distance of rendered images from their targets, with the gradient with respect to the images:
///
///   loss = (1 - s - l) mean |a - b|^p + s (1 - SSIM(a, b)) + l mean over views of LPIPS(a, b)
///        + e edge_loss(a, b),   p = 1 or 2; s, l, e: the weights of kLossTerms
///
/// Alpha is ignored.
///
/// Errors       the recorder's; those of Context::run and of model::LpipsNet
/// Precision    see losses/l1.h, l2.h, ssim.h and edge_loss.h of ops, model/lpips_net.h
/// Determinism  bit-exact for any thread count
class RenderLoss {
  public:
    static Result<RenderLoss> create(vk::Context& context, const RenderLossDesc& desc);

    /// targets  [V,3,H,W]
    Status set_targets(std::span<const float> targets);

    /// [V,1,H,W] as quads: factors of pixels, for operators that take them.
    [[nodiscard]] const vk::BufferView& pixel_weights() const { return pixel_weights_.range(); }

    /// Compute the loss of the image, and write its gradient times `share`. A lpips_weight other than 0 needs
    /// the weights of LPIPS.
    Status run(float share, double lpips_weight, LossTerms& terms);

  private:
    /// An operator of the images: its value is quad i of losses_, the factor of its gradient of weights_; behind them
    /// are those of LPIPS, a quad for each view.
    struct Part {
        const ops::OpRow* row = nullptr;
        std::optional<ops::Attributes> attributes;
        ops::OpViews views;
        std::vector<vk::Buffer> buffers;
        const LossTerm* term = nullptr;  ///< nullptr: of pixels
    };
    explicit RenderLoss(vk::Context& context, const RenderLossDesc& desc)
        : context_(&context), desc_(desc) {}
    Status allocate();
    Status make(vk::Buffer& buffer, std::uint64_t bytes);
    Status add_part(const char* op, const LossTerm* term);
    Status record();

    vk::Context* context_;
    RenderLossDesc desc_;
    vk::Buffer rgb_, targets_, pixel_weights_, losses_, weights_;
    std::vector<Part>
        parts_;              ///< the squared difference, the absolute one if it is the loss, terms
    std::size_t pixel_ = 0;  ///< part of the pixel loss
    vk::Buffer grad_term_;   ///< gradient of one term after another
    std::unique_ptr<model::LpipsNet> lpips_;
    vk::CommandList list_;
};

}  // namespace splat::train
