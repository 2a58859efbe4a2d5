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
    std::uint32_t objects = 1;  ///< compared one after another, in the same memory
    std::uint32_t views = 1;    ///< each object's
    std::uint32_t height = 1, width = 1;
    /// [objects,V,H,W] quads of RGB and alpha; they outlive the loss. An object's part begins at an offset that
    /// bindings take.
    vk::BufferView image, grad_image;
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
///        + e edge_loss(a, b) + t plane,   p = 1 or 2; s, l, e, t: the weights of kLossTerms
///
/// Alpha is ignored. The caller computes the term of planes.
///
/// Errors       the recorder's; those of Context::run and of model::LpipsNet
/// Precision    see losses/l1.h, l2.h, ssim.h and edge_loss.h of ops, model/lpips_net.h
/// Determinism  bit-exact for any thread count
class RenderLoss {
  public:
    static Result<RenderLoss> create(vk::Context& context, const RenderLossDesc& desc);

    /// What the next run() compares with.
    ///
    /// targets  [V,3,H,W], or their levels k, which stand for the float32 nearest to k / 255
    Status set_targets(std::span<const float> targets);
    Status set_targets(std::span<const std::uint8_t> levels);

    /// [V,1,H,W] as quads: factors of pixels, for operators that take them.
    [[nodiscard]] const vk::BufferView& pixel_weights() const { return pixel_weights_.range(); }

    /// The caller writes the value of planes after run() and before it keeps losses(); run() writes the factor of its
    /// gradient.
    [[nodiscard]] vk::BufferView plane_value() const;
    [[nodiscard]] vk::BufferView plane_factor() const;

    /// Compute the loss of an object's image, and write its gradient times `share`. A lpips_weight other than 0 needs
    /// the weights of LPIPS.
    Status run(std::uint32_t object, float share, double lpips_weight);

    /// What the latest run() computed: but for the first `unchecked` bytes, numbers that are finite if the loss is.
    [[nodiscard]] const vk::BufferView& losses() const { return losses_.range(); }
    [[nodiscard]] std::uint64_t unchecked() const;
    /// The terms by the numbers of losses().
    [[nodiscard]] LossTerms terms_of(std::span<const float> losses, double lpips_weight) const;

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
    Status write_targets(std::size_t count, std::span<const std::byte> bytes,
                         vk::CommandList& pack);
    [[nodiscard]] double weight_of(const LossTerm& term, double lpips_weight) const {
        return term.is_lpips() ? lpips_weight : desc_.config.*term.weight;
    }
    [[nodiscard]] double pixel_weight(double lpips_weight) const;
    Status write_weights(float share, double lpips_weight);

    vk::Context* context_;
    RenderLossDesc desc_;
    vk::Buffer rgb_, planes_, targets_, pixel_weights_, losses_, weights_;
    vk::Buffer grad_of_object_;   ///< where there are several
    vk::BufferView grad_;         ///< gradient of the object that is compared
    std::vector<float> written_;  ///< what weights_ holds
    std::vector<Part>
        parts_;              ///< the squared difference, the absolute one if it is the loss, terms
    std::size_t pixel_ = 0;  ///< part of the pixel loss
    vk::Buffer grad_term_;   ///< gradient of one term after another
    std::unique_ptr<model::LpipsNet> lpips_;
    vk::CommandList pack_, pack_levels_;  ///< planes_ to targets_
    vk::CommandList list_;
    std::vector<vk::CommandList> in_, out_;  ///< an object's image to rgb_; grad_ to its gradient
};

}  // namespace splat::train
