#include "train/gradient_sum.h"

#include <bit>

#include "ops/add.h"

namespace splat::train {
namespace {

/// y = a + b, of as many bytes.
Status record_add(vk::Recorder& recorder, const vk::BufferView& a, const vk::BufferView& b,
                  const vk::BufferView& y) {
    const ops::AddDesc desc{{.n = static_cast<std::uint32_t>(y.bytes / 16), .c = 4}};
    return ops::add_forward(recorder, desc, a, b, y);
}

}  // namespace

Result<GradientSum> GradientSum::create(vk::Context& context, nn::Parameters& parameters,
                                        std::uint32_t slices, run::Group* group, bool adds,
                                        const nn::BackwardParts& parts) {
    GradientSum made(context, parameters);
    const std::uint32_t trees = 1U << static_cast<std::uint32_t>(std::countr_zero(slices));
    made.in_order_ = slices / trees;
    made.trees_ = trees / (group == nullptr ? 1 : group->count());
    for (const nn::ParameterBlock& block : parameters.blocks())
        made.gradients_.push_back(block.grads);
    while (made.trees_ >> made.waiting_.size() > 1) {
        SPLAT_ASSIGN(Copy copy, made.allocate());
        made.waiting_.push_back(std::move(copy));
    }
    const bool shares = group != nullptr && group->count() > 1;
    const std::size_t merges = made.trees_ == 1 ? 0 : made.waiting_.size() + (shares ? 0 : 1);
    for (std::uint32_t copies = 0; copies < merges; ++copies) {
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
    if (shares) SPLAT_TRY(made.prepare_exchange(*group, parts));
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

Status GradientSum::prepare_exchange(run::Group& group, const nn::BackwardParts& parts) {
    GradientExchange::Memory memory{gradients_, {}};
    for (const Copy& copy : waiting_) {
        memory.addends.emplace_back();
        for (const vk::Buffer& block : copy) memory.addends.back().push_back(block.range());
    }
    group_ = &group;
    SPLAT_SET(exchange_, GradientExchange::create(*context_, group, *parameters_, parts, memory));
    return {};
}

std::size_t GradientSum::lists() const {
    return merges_.size() + (exchange_ == nullptr ? 0 : exchange_->lists());
}

Status GradientSum::sum(const Slice& slice, double& seconds) {
    if (exchange_ == nullptr) return sum_here(slice, {});
    return exchange_->sum([&](const nn::BetweenParts& between) { return sum_here(slice, between); },
                          seconds);
}

Status GradientSum::add(const Slice& slice, double& seconds) {
    if (before_.empty()) {
        for (std::uint32_t i = 0; i < in_order_; ++i) SPLAT_TRY(slice(i, {}));
        return {};
    }
    const Status keeps = context_->run(keep_);
    const auto after_it = [&](std::uint32_t i, const nn::BetweenParts& between) {
        return keeps.ok() ? slice(i, between) : keeps;
    };
    SPLAT_TRY(sum(after_it, seconds));
    const Status joins = context_->run(join_);
    return group_ == nullptr ? joins : group_->agree(joins);
}

/// `between`: what the last slice calls.
Status GradientSum::sum_here(const Slice& slice, const nn::BetweenParts& between) {
    for (std::uint32_t tree = 0; tree < trees_; ++tree) {
        SPLAT_TRY(parameters_->zero_gradients());
        const bool last = exchange_ != nullptr && tree + 1 == trees_;
        for (std::uint32_t i = 0; i < in_order_; ++i)
            SPLAT_TRY(slice(tree * in_order_ + i,
                            last && i + 1 == in_order_ ? between : nn::BetweenParts()));
        // Carry as a binary counter does: sums of 1, 2, 4... trees wait.
        if (trees_ > 1 && !last)
            SPLAT_TRY(context_->run(merges_[static_cast<std::size_t>(std::countr_one(tree))]));
    }
    return {};
}

}  // namespace splat::train
