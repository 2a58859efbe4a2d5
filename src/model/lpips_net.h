#pragma once

#include <memory>
#include <optional>
#include <span>

#include "io/tensor_file.h"
#include "model/song_unet.h"
#include "nn/executor.h"

namespace splat::model {

/// Tensors of LPIPS in memory of the caller's, as quads.
struct LpipsQuads {
    vk::BufferView render, target, value;
    vk::BufferView grad_value;   ///< may be overwritten by backward
    vk::BufferView grad_render;  ///< backward adds to it
};

struct LpipsDesc {
    std::uint32_t images = 1;
    std::uint32_t side = 128;  ///< pixels, both ways; at least 16
    bool gradients = true;     ///< plan and record the backward pass
    Precision precision = Precision::kBalanced;
    bool keep_prepared = true;  ///< see nn::ExecutorDesc
    /// They need `gradients` and must outlive the network. Without them its tensors are its own and row-major.
    std::optional<LpipsQuads> quads = {};
};

/// LPIPS with VGG16, version 0.1: distance of two images in the features of a network.
///
///   value[n] = sum over layers l of mean over pixels of sum_c w_lc (f_lc(render) - f_lc(target))^2
///
/// f_l: relu1_2, relu2_2, relu3_3, relu4_3 and relu5_3 of VGG16, scaled to length 1 over the channels
/// of each pixel, of images (2x - 1 - shift) / scale with shift (-.030, -.088, -.188) and scale (.458,
/// .448, .450). w_l: the learned weights.
///
/// Precision  value and gradient within 1e-4 of PyTorch's (tests/interop/lpips.py); where a rectifier is
///            within rounding of its edge, gradients of any two float32 programs differ by up to 1e-3
/// Source     Zhang et al. 2018, arXiv:1801.03924; Simonyan & Zisserman 2015, arXiv:1409.1556
class LpipsNet {
  public:
    /// Takes each weight from the first of `weights` that has it, under the names of
    ///   torchvision's vgg16          features.<n>.weight, features.<n>.bias
    ///   the lpips package            lin<k>.model.1.weight [1,C,1,1] or [C]
    ///   a state dict of lpips.LPIPS  net.slice<s>.<n>.weight, net.slice<s>.<n>.bias and lin<k>
    /// Other tensors are ignored. Keeps nothing of `weights`.
    ///
    /// Errors: kInvalidArgument for images that are too small, a missing tensor or one that is not
    /// finite; kShape, naming the tensor; kOutOfDeviceMemory.
    static Result<std::unique_ptr<LpipsNet>> create(
        vk::Context& context, const LpipsDesc& desc,
        std::span<const io::NamedTensors* const> weights);

    /// [images, 3, side, side], RGB, nominally 0 to 1, not clamped. Both are written before each forward pass.
    [[nodiscard]] const vk::BufferView& render() const { return executor_->tensor(render_); }
    [[nodiscard]] const vk::BufferView& target() const { return executor_->tensor(target_); }

    Status forward() { return executor_->forward(); }

    /// [images, 1] after forward.
    [[nodiscard]] const vk::BufferView& values() const { return executor_->tensor(value_); }

    /// [images, 1] that backward reads: gradients of a loss by values().
    [[nodiscard]] const vk::BufferView& value_gradients() const {
        return executor_->gradient(value_);
    }

    /// Call once after each forward.
    Status backward() { return executor_->backward(); }

    /// [images, 3, side, side] after backward; overwritten, unless LpipsQuads::grad_render.
    [[nodiscard]] const vk::BufferView& render_gradient() const {
        return executor_->gradient(render_);
    }

    /// The distance of two images of the host's, [3, side, side], by a network of one.
    Result<double> compare(std::span<const float> render, std::span<const float> target);

  private:
    explicit LpipsNet(vk::Context& context) : context_(context), graph_(context) {}
    void build(const LpipsDesc& desc);
    nn::ValueId convolve(const std::string& name, nn::ValueId x, std::uint32_t out,
                         std::uint32_t kernel, Precision precision);
    std::vector<nn::ValueId> features(nn::ValueId image, Precision precision);
    Status load(std::span<const io::NamedTensors* const> weights);

    vk::Context& context_;
    nn::Graph graph_;
    std::unique_ptr<nn::Parameters> parameters_;
    std::unique_ptr<nn::Executor> executor_;
    nn::ValueId render_ = nn::kNoValue, target_ = nn::kNoValue, value_ = nn::kNoValue;
};

}  // namespace splat::model
