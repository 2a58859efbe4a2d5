#include "train/render_loss.h"

#include <algorithm>

#include "ops/add.h"
#include "ops/quads.h"
#include "ops/strided_copy.h"

namespace splat::train {
namespace {

ops::QuadDims quads_of(const RenderLossDesc& desc) {
    return {desc.views, 3, desc.height * desc.width};
}

/// All of a buffer as images in quads.
vk::BufferView quads(const vk::Buffer& buffer, const RenderLossDesc& desc, std::uint32_t channels) {
    vk::BufferView view = buffer.range();
    view.shape = Shape{desc.views, channels, desc.height, desc.width};
    return view;
}

/// Floats from one scalar to the next: the largest offset alignment that Vulkan allows a device.
constexpr std::size_t kScalarFloats = 256 / sizeof(float);

constexpr std::size_t kLpips = std::size(kLossTerms) - 1;
static_assert(kLossTerms[kLpips].op == nullptr);

constexpr std::size_t kMostParts = 2 + std::size(kLossTerms);

/// Quads of a buffer from the place of scalar i on.
vk::BufferView scalars(const vk::Buffer& buffer, std::size_t i, std::uint32_t quads = 1) {
    vk::BufferView view =
        buffer.range().part(kScalarFloats * sizeof(float) * i, std::uint64_t{16} * quads);
    view.shape = Shape{1};
    return view;
}

}  // namespace

double LossTerms::of(std::string_view name) const {
    std::size_t i = 0;
    while (name != kLossTerms[i].name) ++i;  // callers name what the table has
    return values[i];
}

void LossTerms::add(const LossTerms& other, double share) {
    total += share * other.total;
    squared += share * other.squared;
    pixel += share * other.pixel;
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += share * other.values[i];
}

Result<RenderLoss> RenderLoss::create(vk::Context& context, const RenderLossDesc& desc) {
    RenderLoss loss(context, desc);
    SPLAT_TRY(loss.allocate());
    SPLAT_TRY(loss.record());
    return loss;
}

Status RenderLoss::make(vk::Buffer& buffer, std::uint64_t bytes) {
    SPLAT_ASSIGN(buffer, context_->memory().allocate(bytes, vk::MemoryKind::kDevice,
                                                     "loss of rendered images"));
    return context_->fill(buffer.range(), 0);
}

Status RenderLoss::allocate() {
    const std::uint64_t bytes = quads_of(desc_).bytes();
    SPLAT_TRY(make(rgb_, bytes));  // the fourth channel stays zero
    SPLAT_TRY(make(targets_, bytes));
    for (vk::Buffer* const buffer : {&losses_, &weights_})
        SPLAT_TRY(make(
            *buffer, (kScalarFloats * kMostParts + 4 * std::size_t{desc_.views}) * sizeof(float)));
    if (!desc_.lpips.empty()) {
        if (desc_.height != desc_.width)
            return unsupported("LPIPS of %u x %u pixels, expected a square", desc_.width,
                               desc_.height);
        model::LpipsDesc lpips;
        lpips.images = desc_.views;
        lpips.side = desc_.width;
        lpips.precision = desc_.config.precision;
        lpips.quads = {quads(rgb_, desc_, 3), quads(targets_, desc_, 3),
                       scalars(losses_, kMostParts, desc_.views),
                       scalars(weights_, kMostParts, desc_.views), desc_.grad_image};
        SPLAT_ASSIGN(lpips_, model::LpipsNet::create(*context_, lpips, desc_.lpips));
        desc_.lpips = {};
    }
    if (desc_.pixel_weights) SPLAT_TRY(make(pixel_weights_, bytes));
    SPLAT_TRY(add_part("l2", nullptr));
    if (desc_.config.pixel_loss == config::PixelLoss::kL1) {
        SPLAT_TRY(add_part("l1", nullptr));
        pixel_ = 1;
    }
    for (const LossTerm& term : kLossTerms)
        if (term.op != nullptr && desc_.config.*term.weight != 0)
            SPLAT_TRY(add_part(term.op, &term));
    if (parts_.size() > pixel_ + 1) SPLAT_TRY(make(grad_term_, bytes));
    return {};
}

Status RenderLoss::add_part(const char* op, const LossTerm* term) {
    Part part;
    part.term = term;
    SPLAT_ASSIGN(part.row, ops::find_op(op));
    std::vector<JsonScalar> given;
    if (term != nullptr && term->attributes != nullptr) given = term->attributes(desc_.config);
    SPLAT_ASSIGN(part.attributes, ops::complete_attributes(*part.row, given));
    part.views.inputs = {quads(rgb_, desc_, 3), quads(targets_, desc_, 3)};
    if (part.row->inputs.size() > 2)
        part.views.inputs.push_back(desc_.pixel_weights ? quads(pixel_weights_, desc_, 1)
                                                        : vk::BufferView());
    std::vector<Shape> shapes;
    for (const vk::BufferView& input : part.views.inputs) shapes.push_back(input.shape);
    SPLAT_ASSIGN(const ops::OpPlan plan,
                 part.row->plan(vk::Recorder(*context_), *part.attributes, shapes));
    for (const Shape& shape : plan.saved) {
        SPLAT_TRY(make(part.buffers.emplace_back(), vk::quad_bytes(shape.elements())));
        part.views.saved.push_back(part.buffers.back().view(shape));
    }
    if (const std::uint64_t bytes = std::max(plan.forward_workspace, plan.backward_workspace);
        bytes > 0) {
        SPLAT_TRY(make(part.buffers.emplace_back(), bytes));
        part.views.workspace = part.buffers.back().range();
    }
    part.views.outputs = {scalars(losses_, parts_.size())};
    part.views.grad_outputs = {scalars(weights_, parts_.size())};
    part.views.grad_inputs.resize(part.row->inputs.size());
    parts_.push_back(std::move(part));
    return {};
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

Status RenderLoss::record() {
    const ops::QuadDims dims = quads_of(desc_);
    const vk::BufferView& grad_image = desc_.grad_image;
    vk::Recorder recorder(*context_);
    SPLAT_TRY(ops::strided_copy(recorder, {dims.quads(), 3, {4, 0}, {4, 0}, false}, desc_.image,
                                rgb_.range()));
    for (const Part& part : parts_)
        SPLAT_TRY(part.row->forward(recorder, *part.attributes, part.views));
    for (std::size_t i = pixel_; i < parts_.size(); ++i) {
        Part& part = parts_[i];
        part.views.grad_inputs[0] = i == pixel_ ? grad_image : grad_term_.range();
        part.views.grad_inputs[0].shape = part.views.inputs[0].shape;
        SPLAT_TRY(part.row->backward(recorder, *part.attributes, part.views));
        if (i > pixel_)
            SPLAT_TRY(
                ops::add_forward(recorder, {dims, 1}, grad_image, grad_term_.range(), grad_image));
    }
    SPLAT_ASSIGN(list_, recorder.finish());
    return {};
}

Status RenderLoss::run(float share, double lpips_weight, LossTerms& terms) {
    const auto weight_of = [&](const LossTerm& term) {
        return term.op == nullptr ? lpips_weight : desc_.config.*term.weight;
    };
    double pixel_weight = 1;
    for (const LossTerm& term : kLossTerms)
        if (term.replaces) pixel_weight -= weight_of(term);
    // Factors of gradients go out, and losses come back in the same places.
    std::vector<float> numbers(weights_.bytes() / sizeof(float));
    for (std::size_t i = pixel_; i < parts_.size(); ++i) {
        const LossTerm* const term = parts_[i].term;
        const auto weight =
            static_cast<float>(term == nullptr ? pixel_weight : desc_.config.*term->weight);
        numbers[kScalarFloats * i] =
            term != nullptr && term->similarity ? -share * weight : share * weight;
    }
    const auto of_view = [&](std::size_t view) -> float& {
        return numbers[kScalarFloats * kMostParts + 4 * view];
    };
    for (std::size_t view = 0; view < desc_.views; ++view)
        of_view(view) = static_cast<float>(static_cast<double>(share) * lpips_weight / desc_.views);
    SPLAT_TRY(context_->write(weights_.range(), numbers.data(), weights_.bytes()));
    SPLAT_TRY(context_->run(list_));
    if (lpips_weight != 0) {
        SPLAT_TRY(lpips_->forward());
        SPLAT_TRY(lpips_->backward());
    }
    SPLAT_TRY(context_->read(losses_.range(), numbers.data(), losses_.bytes()));
    terms = {};
    for (std::size_t view = 0; lpips_weight != 0 && view < desc_.views; ++view)
        terms.values[kLpips] += static_cast<double>(of_view(view)) / desc_.views;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
        const auto value = static_cast<double>(numbers[kScalarFloats * i]);
        if (i == 0) terms.squared = value;
        if (i == pixel_) terms.pixel = value;
        if (parts_[i].term != nullptr)
            terms.values[static_cast<std::size_t>(parts_[i].term - kLossTerms)] = value;
    }
    terms.total = pixel_weight * terms.pixel;
    for (std::size_t i = std::size(kLossTerms); i-- > 0;) {
        const double value = terms.values[i];
        if (const double weight = weight_of(kLossTerms[i]); weight != 0)
            terms.total += weight * (kLossTerms[i].similarity ? 1 - value : value);
    }
    return {};
}

}  // namespace splat::train
