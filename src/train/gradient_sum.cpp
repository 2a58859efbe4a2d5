#include "train/gradient_sum.h"

#include <algorithm>
#include <bit>

#include "core/checked_math.h"
#include "core/stopwatch.h"
#include "ops/add.h"

namespace splat::train {
namespace {

/// Bytes of the gradients that cross between ranks at a time: as many as transfers stage at once.
constexpr std::uint64_t kPieceBytes = std::uint64_t{8} << 20;
/// The largest offset alignment that Vulkan allows a device.
constexpr std::uint64_t kPartAlignment = 256;

/// y = a + b, of as many bytes.
Status record_add(vk::Recorder& recorder, const vk::BufferView& a, const vk::BufferView& b,
                  const vk::BufferView& y) {
    const ops::AddDesc desc{{.n = static_cast<std::uint32_t>(y.bytes / 16), .c = 4}};
    return ops::add_forward(recorder, desc, a, b, y);
}

}  // namespace

Result<GradientSum> GradientSum::create(vk::Context& context, nn::Parameters& parameters,
                                        std::uint32_t slices, run::Group* group, bool adds) {
    GradientSum made(context, parameters, group);
    const std::uint32_t trees = 1U << static_cast<std::uint32_t>(std::countr_zero(slices));
    made.in_order_ = slices / trees;
    made.trees_ = trees / (group == nullptr ? 1 : group->count());
    for (const nn::ParameterBlock& block : parameters.blocks())
        made.gradients_.push_back(block.grads);
    while (made.trees_ >> made.waiting_.size() > 1) {
        SPLAT_ASSIGN(Copy copy, made.allocate());
        made.waiting_.push_back(std::move(copy));
    }
    for (std::uint32_t copies = 0; made.trees_ > 1 && copies <= made.waiting_.size(); ++copies) {
        SPLAT_ASSIGN(vk::CommandList list, made.record_merge(copies));
        made.merges_.push_back(std::move(list));
    }
    if (adds && trees > 1) {
        SPLAT_SET(made.before_, made.allocate());
        vk::Recorder keep(context), join(context);
        for (std::size_t i = 0; i < made.gradients_.size(); ++i) {
            const vk::BufferView& sum = made.gradients_[i];
            SPLAT_TRY(keep.copy(sum, made.before_[i].range()));
            SPLAT_TRY(record_add(join, made.before_[i].range(), sum, sum));
        }
        SPLAT_SET(made.keep_, keep.finish());
        SPLAT_SET(made.join_, join.finish());
    }
    if (group != nullptr && group->count() > 1) SPLAT_TRY(made.prepare_pieces());
    return made;
}

Result<GradientSum::Copy> GradientSum::allocate() const {
    Copy copy;
    for (const vk::BufferView& block : gradients_) {
        SPLAT_ASSIGN(vk::Buffer buffer,
                     context_->memory().allocate(block.bytes, vk::MemoryKind::kDevice,
                                                 "gradients of slices"));
        copy.push_back(std::move(buffer));
    }
    return copy;
}

/// Add the first `copies` of waiting_ to the gradients. The sum waits in the next one, or all is summed.
Result<vk::CommandList> GradientSum::record_merge(std::uint32_t copies) const {
    vk::Recorder recorder(*context_);
    const bool last = copies == waiting_.size();
    for (std::size_t i = 0; i < gradients_.size(); ++i) {
        const vk::BufferView& sum = gradients_[i];
        const vk::BufferView& to = last ? sum : waiting_[copies][i].range();
        if (copies == 0 && !last) SPLAT_TRY(recorder.copy(sum, to));
        for (std::uint32_t level = 0; level < copies; ++level)
            SPLAT_TRY(record_add(recorder, waiting_[level][i].range(), sum,
                                 level + 1 < copies ? sum : to));
    }
    return recorder.finish();
}

Status GradientSum::prepare_pieces() {
    const auto levels = static_cast<std::uint32_t>(std::countr_zero(group_->count()));
    for (const vk::BufferView& block : gradients_)
        for (std::uint64_t at = 0; at < block.bytes; at += kPieceBytes)
            pieces_.push_back({block.part(at, std::min(kPieceBytes, block.bytes - at)), {}});
    std::uint64_t most = 0;
    for (const Piece& piece : pieces_)
        most = std::max(most, part_bytes(piece.view.bytes) * group_->count());
    host_.resize(most);
    if (!group_->reproducible()) return {};
    from_partner_.resize(most / 2);
    SPLAT_SET(received_, context_->memory().allocate(most / 2, vk::MemoryKind::kDevice,
                                                     "gradients of another rank"));
    for (Piece& piece : pieces_)
        for (std::uint32_t level = 0; level < levels; ++level) {
            const vk::BufferView sum = view_of(piece, kept(level + 1, group_->rank()));
            piece.adds.emplace_back();
            if (sum.bytes == 0) continue;
            vk::Recorder recorder(*context_);
            SPLAT_TRY(record_add(recorder, sum, received_.range().part(0, sum.bytes), sum));
            SPLAT_SET(piece.adds.back(), recorder.finish());
        }
    return {};
}

std::uint64_t GradientSum::part_bytes(std::uint64_t piece) const {
    return round_up(ceil_div(piece, group_->count()), kPartAlignment);
}

vk::BufferView GradientSum::view_of(const Piece& piece, const Parts& parts) const {
    const std::uint64_t each = part_bytes(piece.view.bytes);
    const std::uint64_t first = std::min(parts.first * each, piece.view.bytes);
    return piece.view.part(first, std::min(parts.end * each, piece.view.bytes) - first);
}

GradientSum::Parts GradientSum::kept(std::uint32_t levels, std::uint32_t rank) const {
    Parts parts{0, group_->count()};
    for (std::uint32_t level = 0; level < levels; ++level) {
        const std::uint64_t half = (parts.first + parts.end) / 2;
        ((rank >> level & 1U) == 0 ? parts.end : parts.first) = half;
    }
    return parts;
}

std::size_t GradientSum::lists() const {
    const std::size_t each = pieces_.empty() ? 0 : 2 * pieces_.front().adds.size() + 2;
    return merges_.size() + each * pieces_.size();
}

Status GradientSum::sum(const Slice& slice, double& seconds) {
    Status here = sum_here(slice);
    if (group_ == nullptr) return here;
    if (here.ok()) here = context_->flush();
    const Stopwatch watch;
    context_->charge = nullptr;
    const Status done = exchange(here);
    seconds += watch.seconds();
    return done;
}

Status GradientSum::add(const Slice& slice, double& seconds) {
    if (before_.empty()) {
        for (std::uint32_t i = 0; i < in_order_; ++i) SPLAT_TRY(slice(i));
        return {};
    }
    const Status keeps = context_->run(keep_);
    const auto after_it = [&](std::uint32_t i) { return keeps.ok() ? slice(i) : keeps; };
    SPLAT_TRY(sum(after_it, seconds));
    const Status joins = context_->run(join_);
    return group_ == nullptr ? joins : group_->agree(joins);
}

Status GradientSum::sum_here(const Slice& slice) {
    for (std::uint32_t tree = 0; tree < trees_; ++tree) {
        SPLAT_TRY(parameters_->zero_gradients());
        for (std::uint32_t i = 0; i < in_order_; ++i) SPLAT_TRY(slice(tree * in_order_ + i));
        // Carry as a binary counter does: sums of 1, 2, 4... trees wait.
        if (trees_ > 1)
            SPLAT_TRY(context_->run(merges_[static_cast<std::size_t>(std::countr_one(tree))]));
    }
    return {};
}

Status GradientSum::exchange(const Status& here) {
    SPLAT_TRY(group_->agree(here));
    Status device;
    for (Piece& piece : pieces_) SPLAT_TRY(exchange(piece, device));
    if (device.ok()) device = context_->flush();
    return group_->agree(device);
}

/// `device`: the first error of the device, after which partners still get as many bytes.
Status GradientSum::exchange(Piece& piece, Status& device) {
    const std::uint64_t each = part_bytes(piece.view.bytes);
    const auto host_of = [&](const Parts& parts) {
        return std::span(host_).subspan(parts.first * each, (parts.end - parts.first) * each);
    };
    const auto read = [&](const Parts& parts) {
        const vk::BufferView view = view_of(piece, parts);
        if (device.ok() && view.bytes > 0)
            device = context_->read(view, host_of(parts).data(), view.bytes);
    };
    const auto write = [&](const vk::BufferView& view, std::span<const std::byte> bytes) {
        if (device.ok() && view.bytes > 0) device = context_->write(view, bytes.data(), view.bytes);
    };
    const std::uint32_t rank = group_->rank();
    const auto partner_of = [&](std::uint32_t level) { return rank ^ (1U << level); };
    const Parts all{0, group_->count()};
    if (!group_->reproducible()) {
        read(all);
        SPLAT_TRY(group_->sum({reinterpret_cast<float*>(host_.data()), piece.view.bytes / 4}));
        write(piece.view, host_);
        return {};
    }
    const auto levels = static_cast<std::uint32_t>(piece.adds.size());
    for (std::uint32_t level = 0; level < levels; ++level) {
        const std::uint32_t partner = partner_of(level);
        const Parts theirs = kept(level + 1, partner);
        read(theirs);
        const auto got = std::span(from_partner_).first(host_of(theirs).size());
        SPLAT_TRY(group_->exchange(partner, host_of(theirs), got));
        write(received_.range().part(0, view_of(piece, kept(level + 1, rank)).bytes), got);
        if (device.ok()) device = context_->run(piece.adds[level]);
    }
    read(kept(levels, rank));
    for (std::uint32_t level = levels; level-- > 0;) {
        const std::uint32_t partner = partner_of(level);
        const Parts theirs = kept(level + 1, partner);
        SPLAT_TRY(group_->exchange(partner, host_of(kept(level + 1, rank)), host_of(theirs)));
        write(view_of(piece, theirs), host_of(theirs));
    }
    return {};
}

}  // namespace splat::train
