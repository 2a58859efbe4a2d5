// CO3D's terms of scales, and how Trainer takes their means over a batch that it sees in passes.

#include "train/scale_terms.h"

#include <cmath>

#include "train/trainer.h"

namespace splat::train {
namespace {

constexpr float kMostScale = 20, kLeastScale = 1e-5F;
constexpr float kScaleWeight = 0.1F;

}  // namespace

void ScaleOutliers::add(std::span<const float> scales) {
    for (const float s : scales) {
        if (s > kMostScale) {
            ++large;
            large_sum += double{s};
        }
        if (s < kLeastScale) {
            ++small;
            small_sum -= std::log(double{s});
        }
    }
}

void ScaleOutliers::add(const ScaleOutliers& others) {
    large += others.large;
    small += others.small;
    large_sum += others.large_sum;
    small_sum += others.small_sum;
}

ScaleOutliers sum_of(std::span<const ScaleOutliers> parts) {
    ScaleOutliers sum;
    for (const ScaleOutliers& part : parts) sum.add(part);
    return sum;
}

double ScaleOutliers::loss() const {
    double mean = 0;
    if (large > 0) mean += large_sum / static_cast<double>(large);
    if (small > 0) mean += small_sum / static_cast<double>(small);
    return double{kScaleWeight} * mean;
}

void add_scale_gradients(std::span<const float> scales, const ScaleOutliers& batch,
                         std::span<float> gradients) {
    for (std::size_t i = 0; i < scales.size(); ++i) {
        const float s = scales[i];
        if (s > kMostScale) gradients[i] += kScaleWeight / static_cast<float>(batch.large);
        if (s < kLeastScale) gradients[i] -= kScaleWeight / static_cast<float>(batch.small) / s;
    }
}

/// The scales [n,3] of a set, or their gradients.
Result<std::vector<float>> Trainer::read_scales(const gaussians::SetViews& set) {
    std::vector<float> quads(std::size_t{set.count} * gaussians::kGaussianFloats);
    SPLAT_TRY(context_.read(set.gaussians, quads.data(), quads.size() * sizeof(float)));
    std::vector<float> scales;
    for (std::size_t at = gaussians::kScaleAt; at < quads.size(); at += gaussians::kGaussianFloats)
        scales.insert(scales.end(), {quads[at], quads[at + 1], quads[at + 2]});
    return scales;
}

Status Trainer::take_scales(std::uint32_t pass, Outliers& outliers) {
    SPLAT_ASSIGN(const std::vector<float> scales, read_scales(model_->sets()));
    outliers[pass].add(scales);
    if (!outliers[pass].any() || !knows_all(pass)) return {};
    return add_to_gradients(scales, sum_of(outliers));
}

Status Trainer::add_to_gradients(std::span<const float> scales, const ScaleOutliers& batch) {
    const gaussians::SetViews set = model_->sets(true);
    std::vector<float> quads(std::size_t{set.count} * gaussians::kGaussianFloats);
    SPLAT_TRY(context_.read(set.gaussians, quads.data(), quads.size() * sizeof(float)));
    for (std::size_t i = 0; i < set.count; ++i)
        add_scale_gradients(
            scales.subspan(3 * i, 3), batch,
            std::span(quads).subspan(i * gaussians::kGaussianFloats + gaussians::kScaleAt, 3));
    return context_.write(set.gaussians, quads.data(), quads.size() * sizeof(float));
}

Status Trainer::repeat_for_scales(const TrainBatch& batch, const Outliers& outliers,
                                  TrainStep& result) {
    const ScaleOutliers all = sum_of(outliers);
    if (!all.any()) return {};
    const auto repeat = [&](std::uint32_t slice, const nn::BetweenParts& between) -> Status {
        const std::uint32_t pass = first_pass() + slice;
        if (!outliers[pass].any() || knows_all(pass)) return {};
        return repeat_for_scales(batch, slice * config_.micro_batch, all, result, between);
    };
    return gradients_->add(repeat, result.exchange_seconds);
}

Status Trainer::repeat_for_scales(const TrainBatch& batch, std::uint32_t first,
                                  const ScaleOutliers& all, TrainStep& result,
                                  const nn::BetweenParts& between) {
    SPLAT_TRY(set_input(batch, first, result));
    SPLAT_TRY(model_->forward_unread());
    const gaussians::SetViews gradients = model_->sets(true);
    SPLAT_TRY(context_.fill(gradients.gaussians, 0));
    SPLAT_TRY(context_.fill(gradients.colors, 0));
    SPLAT_ASSIGN(const std::vector<float> scales, read_scales(model_->sets()));
    SPLAT_TRY(add_to_gradients(scales, all));
    return model_->backward(true, between);
}

}  // namespace splat::train
