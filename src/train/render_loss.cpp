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

constexpr std::size_t kLpips = std::size(kLossTerms) - 1, kPlaneTerm = kLpips - 1;
static_assert(kLossTerms[kLpips].is_lpips());
static_assert(kLossTerms[kPlaneTerm].weight == &config::TrainConfig::plane_weight);

constexpr std::size_t kMostParts = 2 + std::size(kLossTerms);
/// The value of planes takes the last of the parts' places, which LPIPS, computed apart, leaves free.
constexpr std::size_t kPlanes = kMostParts - 1;

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
    SPLAT_TRY(make(planes_, vk::quad_bytes(quads(targets_, desc_, 3).shape.elements())));
    SPLAT_TRY(make(targets_, bytes));
    grad_ = desc_.grad_image;
    if (desc_.objects > 1) {
        SPLAT_TRY(make(grad_of_object_, bytes));
        grad_ = grad_of_object_.range();
    }
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
                       scalars(weights_, kMostParts, desc_.views), grad_};
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

Status RenderLoss::write_targets(std::size_t count, std::span<const std::byte> bytes,
                                 vk::CommandList& pack) {
    const std::size_t pixels = std::size_t{desc_.height} * desc_.width;
    if (count != desc_.views * pixels * 3)
        return error(Code::kShape, "targets: %zu numbers, expected %u x 3 x %u x %u", count,
                     desc_.views, desc_.height, desc_.width);
    SPLAT_TRY(context_->write(planes_.range(), bytes.data(), bytes.size()));
    return context_->run(pack);
}

Status RenderLoss::set_targets(std::span<const float> targets) {
    return write_targets(targets.size(), std::as_bytes(targets), pack_);
}

Status RenderLoss::set_targets(std::span<const std::uint8_t> levels) {
    return write_targets(levels.size(), std::as_bytes(levels), pack_levels_);
}

Status RenderLoss::record() {
    const ops::QuadDims dims = quads_of(desc_);
    vk::Recorder recorder(*context_);
    SPLAT_TRY(ops::quads_pack(recorder, quads(planes_, desc_, 3), quads(targets_, desc_, 3)));
    SPLAT_SET(pack_, recorder.finish());
    SPLAT_TRY(
        ops::quads_pack_levels(recorder, quads(planes_, desc_, 3), quads(targets_, desc_, 3)));
    SPLAT_SET(pack_levels_, recorder.finish());
    for (std::uint32_t object = 0; object < desc_.objects; ++object) {
        const auto part = [&](const vk::BufferView& all) {
            return all.part(object * dims.bytes(), dims.bytes());
        };
        SPLAT_TRY(ops::strided_copy(recorder, {dims.quads(), 3, {4, 0}, {4, 0}, false},
                                    part(desc_.image), rgb_.range()));
        SPLAT_SET(in_.emplace_back(), recorder.finish());
        if (desc_.objects == 1) break;
        SPLAT_TRY(ops::strided_copy(recorder, {dims.quads(), 4, {4, 0}, {4, 0}, false}, grad_,
                                    part(desc_.grad_image)));
        SPLAT_SET(out_.emplace_back(), recorder.finish());
    }
    for (const Part& part : parts_)
        SPLAT_TRY(part.row->forward(recorder, *part.attributes, part.views));
    for (std::size_t i = pixel_; i < parts_.size(); ++i) {
        Part& part = parts_[i];
        part.views.grad_inputs[0] = i == pixel_ ? grad_ : grad_term_.range();
        part.views.grad_inputs[0].shape = part.views.inputs[0].shape;
        SPLAT_TRY(part.row->backward(recorder, *part.attributes, part.views));
        if (i > pixel_)
            SPLAT_TRY(ops::add_forward(recorder, {dims, 1}, grad_, grad_term_.range(), grad_));
    }
    SPLAT_SET(list_, recorder.finish());
    return {};
}

double RenderLoss::pixel_weight(double lpips_weight) const {
    double weight = 1;
    for (const LossTerm& term : kLossTerms)
        if (term.replaces) weight -= weight_of(term, lpips_weight);
    return weight;
}

/// The factors of the terms' gradients, in the places of their values.
Status RenderLoss::write_weights(float share, double lpips_weight) {
    std::vector<float> numbers(weights_.bytes() / sizeof(float));
    for (std::size_t i = pixel_; i < parts_.size(); ++i) {
        const LossTerm* const term = parts_[i].term;
        const auto weight = static_cast<float>(term == nullptr ? pixel_weight(lpips_weight)
                                                               : desc_.config.*term->weight);
        numbers[kScalarFloats * i] =
            term != nullptr && term->similarity ? -share * weight : share * weight;
    }
    for (std::size_t view = 0; view < desc_.views; ++view)
        numbers[kScalarFloats * kMostParts + 4 * view] =
            static_cast<float>(static_cast<double>(share) * lpips_weight / desc_.views);
    numbers[kScalarFloats * kPlanes] = share * static_cast<float>(desc_.config.plane_weight);
    if (numbers == written_) return {};
    written_.clear();
    SPLAT_TRY(context_->write(weights_.range(), numbers.data(), weights_.bytes()));
    written_ = std::move(numbers);
    return {};
}

LossTerms RenderLoss::terms_of(std::span<const float> losses, double lpips_weight) const {
    LossTerms terms;
    for (std::size_t view = 0; lpips_weight != 0 && view < desc_.views; ++view)
        terms.values[kLpips] +=
            static_cast<double>(losses[kScalarFloats * kMostParts + 4 * view]) / desc_.views;
    terms.values[kPlaneTerm] = static_cast<double>(losses[kScalarFloats * kPlanes]);
    for (std::size_t i = 0; i < parts_.size(); ++i) {
        const auto value = static_cast<double>(losses[kScalarFloats * i]);
        if (i == 0) terms.squared = value;
        if (i == pixel_) terms.pixel = value;
        if (parts_[i].term != nullptr)
            terms.values[static_cast<std::size_t>(parts_[i].term - kLossTerms)] = value;
    }
    terms.total = pixel_weight(lpips_weight) * terms.pixel;
    for (std::size_t i = std::size(kLossTerms); i-- > 0;) {
        const double value = terms.values[i];
        if (const double weight = weight_of(kLossTerms[i], lpips_weight); weight != 0)
            terms.total += weight * (kLossTerms[i].similarity ? 1 - value : value);
    }
    return terms;
}

vk::BufferView RenderLoss::plane_value() const {
    return scalars(losses_, kPlanes);
}

vk::BufferView RenderLoss::plane_factor() const {
    return scalars(weights_, kPlanes);
}

std::uint64_t RenderLoss::unchecked() const {
    return kScalarFloats * sizeof(float) * pixel_;  // a squared difference that is not part of it
}

Status RenderLoss::run(std::uint32_t object, float share, double lpips_weight) {
    SPLAT_TRY(write_weights(share, lpips_weight));
    SPLAT_TRY(context_->run(in_[object]));
    SPLAT_TRY(context_->run(list_));
    if (lpips_weight != 0) {
        SPLAT_TRY(lpips_->forward());
        SPLAT_TRY(lpips_->backward());
    } else if (lpips_ != nullptr) {
        SPLAT_TRY(context_->fill(scalars(losses_, kMostParts, desc_.views), 0));
    }
    return out_.empty() ? Status() : context_->run(out_[object]);
}

}  // namespace splat::train
