#include "train/render_loss.h"

#include <algorithm>

#include "ops/add.h"
#include "ops/losses/edge_loss.h"
#include "ops/losses/l1.h"
#include "ops/losses/l2.h"
#include "ops/losses/loss.h"
#include "ops/losses/ssim.h"
#include "ops/quads.h"
#include "ops/strided_copy.h"

namespace splat::train {
namespace {

ops::QuadDims quads_of(const RenderLossDesc& desc) {
    return {desc.views, 3, desc.height * desc.width};
}

ops::SsimDesc ssim_of(const RenderLossDesc& desc) {
    return {desc.views, 3, desc.height, desc.width};
}

ops::EdgeLossDesc edges_of(const RenderLossDesc& desc) {
    return {desc.views,
            3,
            desc.height,
            desc.width,
            desc.edge_filter == config::EdgeFilter::kScharr,
            desc.edge_weights};
}

/// Bytes from one scalar to the next: the largest offset alignment that Vulkan allows a device.
constexpr std::uint64_t kScalarBytes = 256;

constexpr std::uint64_t kLosses = 4, kWeights = 3;

vk::BufferView scalar(const vk::Buffer& buffer, std::uint64_t i) {
    vk::BufferView view = buffer.range();
    view.offset += kScalarBytes * i;
    view.bytes = 16;
    view.shape = Shape{1};
    return view;
}

}  // namespace

Result<RenderLoss> RenderLoss::create(vk::Context& context, const RenderLossDesc& desc) {
    RenderLoss loss(context, desc);
    SPLAT_TRY(loss.allocate());
    return loss;
}

Status RenderLoss::allocate() {
    const ops::QuadDims dims = quads_of(desc_);
    const auto make = [&](vk::Buffer& buffer, std::uint64_t bytes) -> Status {
        SPLAT_ASSIGN(buffer, context_->memory().allocate(bytes, vk::MemoryKind::kDevice,
                                                         "loss of rendered images"));
        return context_->fill(buffer.range(), 0);
    };
    SPLAT_TRY(make(rgb_, dims.bytes()));  // the fourth channel stays zero
    SPLAT_TRY(make(targets_, dims.bytes()));
    SPLAT_TRY(make(partial_, ops::loss_partial_bytes(dims)));
    SPLAT_TRY(make(losses_, kLosses * kScalarBytes));
    SPLAT_TRY(make(weights_, kWeights * kScalarBytes));
    if (!desc_.lpips.empty()) {
        if (desc_.height != desc_.width)
            return error(Code::kUnsupported, "LPIPS of %u x %u pixels, expected a square",
                         desc_.width, desc_.height);
        model::LpipsDesc lpips;
        lpips.images = desc_.views;
        lpips.side = desc_.width;
        lpips.precision = desc_.precision;
        SPLAT_ASSIGN(lpips_, model::LpipsNet::create(*context_, lpips, desc_.lpips));
        desc_.lpips = {};
        SPLAT_TRY(make(grad_lpips_, dims.bytes()));
    }
    if (desc_.edge_weight != 0) {
        SPLAT_TRY(make(edge_slopes_, ops::edge_loss_slopes_bytes(edges_of(desc_))));
        if (desc_.edge_weights)
            SPLAT_TRY(
                make(edge_weights_, std::uint64_t{16} * desc_.views * desc_.height * desc_.width));
    }
    if (desc_.edge_weight != 0 || desc_.ssim_weight != 0) SPLAT_TRY(make(grad_term_, dims.bytes()));
    if (desc_.ssim_weight == 0) return {};
    const ops::SsimDesc ssim = ssim_of(desc_);
    SPLAT_TRY(make(slopes_, ops::ssim_slopes_bytes(ssim)));
    return make(rows_,
                std::max(ops::ssim_forward_rows_bytes(ssim), ops::ssim_backward_rows_bytes(ssim)));
}

Status RenderLoss::set_targets(std::span<const float> targets) {
    const std::size_t pixels = std::size_t{desc_.height} * desc_.width;
    if (targets.size() != desc_.views * pixels * 3)
        return error(Code::kShape, "targets: %zu numbers, expected %u x 3 x %u x %u",
                     targets.size(), desc_.views, desc_.height, desc_.width);
    std::vector<float> quads(4 * desc_.views * pixels);
    for (std::size_t view = 0; view < desc_.views; ++view)
        for (std::size_t c = 0; c < 3; ++c) {
            const float* const plane = targets.data() + (3 * view + c) * pixels;
            for (std::size_t i = 0; i < pixels; ++i) quads[4 * (view * pixels + i) + c] = plane[i];
        }
    return context_->write(targets_.range(), quads.data(), quads.size() * sizeof(float));
}

Status RenderLoss::record_backward(vk::Recorder& recorder, const vk::BufferView& grad_image) {
    const ops::QuadDims dims = quads_of(desc_);
    const vk::BufferView& a = rgb_.range();
    const vk::BufferView& b = targets_.range();
    const vk::BufferView weight = scalar(weights_, 0);
    SPLAT_TRY(desc_.pixel_loss == config::PixelLoss::kL1
                  ? ops::l1_backward(recorder, dims, a, b, weight, grad_image)
                  : ops::l2_backward(recorder, dims, a, b, weight, grad_image));
    const auto add_term = [&] {
        return ops::add_forward(recorder, {dims, 1}, grad_image, grad_term_.range(), grad_image);
    };
    if (desc_.ssim_weight != 0) {
        SPLAT_TRY(ops::ssim_backward(recorder, ssim_of(desc_), a, b, slopes_.range(), rows_.range(),
                                     scalar(weights_, 1), grad_term_.range()));
        SPLAT_TRY(add_term());
    }
    if (desc_.edge_weight == 0) return {};
    SPLAT_TRY(ops::edge_loss_backward(recorder, edges_of(desc_), edge_slopes_.range(),
                                      scalar(weights_, 2), grad_term_.range()));
    return add_term();
}

Status RenderLoss::record(const vk::BufferView& image, const vk::BufferView& grad_image) {
    const ops::QuadDims dims = quads_of(desc_);
    const vk::BufferView& a = rgb_.range();
    const vk::BufferView& b = targets_.range();
    vk::Recorder recorder(*context_);
    SPLAT_TRY(ops::strided_copy(recorder, {dims.quads(), 3, {4, 0}, {4, 0}, false}, image, a));
    SPLAT_TRY(ops::l2_forward(recorder, dims, a, b, partial_.range(), scalar(losses_, 0)));
    if (desc_.pixel_loss == config::PixelLoss::kL1)
        SPLAT_TRY(ops::l1_forward(recorder, dims, a, b, partial_.range(), scalar(losses_, 1)));
    if (desc_.ssim_weight != 0)
        SPLAT_TRY(ops::ssim_forward(recorder, ssim_of(desc_), a, b, rows_.range(), slopes_.range(),
                                    partial_.range(), scalar(losses_, 2)));
    if (desc_.edge_weight != 0)
        SPLAT_TRY(ops::edge_loss_forward(recorder, edges_of(desc_), a, b, edge_weights_.range(),
                                         edge_slopes_.range(), partial_.range(),
                                         scalar(losses_, 3)));
    SPLAT_TRY(record_backward(recorder, grad_image));
    SPLAT_ASSIGN(list_, recorder.finish());
    if (lpips_ != nullptr) SPLAT_TRY(record_lpips(grad_image));
    image_ = image;
    grad_image_ = grad_image;
    return {};
}

Status RenderLoss::record_lpips(const vk::BufferView& grad_image) {
    const auto as_quads = [&](const vk::Buffer& buffer) {
        vk::BufferView view = buffer.range();
        view.shape = Shape{desc_.views, 3, desc_.height, desc_.width};
        return view;
    };
    vk::Recorder to(*context_);
    SPLAT_TRY(ops::quads_unpack(to, as_quads(rgb_), lpips_->render()));
    SPLAT_TRY(ops::quads_unpack(to, as_quads(targets_), lpips_->target()));
    SPLAT_ASSIGN(to_lpips_, to.finish());
    vk::Recorder from(*context_);
    SPLAT_TRY(ops::quads_pack(from, lpips_->render_gradient(), as_quads(grad_lpips_)));
    SPLAT_TRY(
        ops::add_forward(from, {quads_of(desc_), 1}, grad_image, grad_lpips_.range(), grad_image));
    SPLAT_ASSIGN(from_lpips_, from.finish());
    return {};
}

Status RenderLoss::run_lpips(double weight, LossTerms& terms) {
    SPLAT_TRY(context_->run(to_lpips_));
    SPLAT_TRY(lpips_->forward());
    std::vector<float> values(desc_.views);
    SPLAT_TRY(context_->read(lpips_->values(), values.data(), values.size() * sizeof(float)));
    for (const float value : values) terms.lpips += static_cast<double>(value) / desc_.views;
    const std::vector<float> slopes(desc_.views, static_cast<float>(weight / desc_.views));
    SPLAT_TRY(
        context_->write(lpips_->value_gradients(), slopes.data(), slopes.size() * sizeof(float)));
    SPLAT_TRY(lpips_->backward());
    return context_->run(from_lpips_);
}

Status RenderLoss::run(const vk::BufferView& image, const vk::BufferView& grad_image, float share,
                       double lpips_weight, LossTerms& terms) {
    if (list_.empty() || !image_.same_range(image) || !grad_image_.same_range(grad_image))
        SPLAT_TRY(record(image, grad_image));
    const double pixel_weight = 1 - desc_.ssim_weight - lpips_weight;
    const float gradients[kWeights] = {share * static_cast<float>(pixel_weight),
                                       // the loss falls when the similarity rises
                                       -share * static_cast<float>(desc_.ssim_weight),
                                       share * static_cast<float>(desc_.edge_weight)};
    for (std::uint64_t i = 0; i < kWeights; ++i)
        SPLAT_TRY(context_->write(scalar(weights_, i), &gradients[i], sizeof(float)));
    SPLAT_TRY(context_->run(list_));
    terms = {};
    if (lpips_weight != 0) SPLAT_TRY(run_lpips(static_cast<double>(share) * lpips_weight, terms));
    float losses[kLosses] = {};
    for (std::uint64_t i = 0; i < kLosses; ++i)
        SPLAT_TRY(context_->read(scalar(losses_, i), &losses[i], sizeof(float)));
    const bool l1 = desc_.pixel_loss == config::PixelLoss::kL1;
    terms.squared = static_cast<double>(losses[0]);
    terms.pixel = static_cast<double>(losses[l1 ? 1 : 0]);
    terms.ssim = static_cast<double>(losses[2]);
    terms.edge = static_cast<double>(losses[3]);
    terms.total = pixel_weight * terms.pixel + lpips_weight * terms.lpips +
                  desc_.edge_weight * terms.edge +
                  (desc_.ssim_weight == 0 ? 0 : desc_.ssim_weight * (1 - terms.ssim));
    return {};
}

}  // namespace splat::train
