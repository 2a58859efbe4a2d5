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

Status Trainer::take_scales(std::uint32_t first, ScaleTerms& terms) {
    const vk::BufferView view = model_->outputs().scales;
    std::vector<float> scales(view.shape.elements());
    SPLAT_TRY(context_.read(view, scales.data(), scales.size() * sizeof(float)));
    ScaleOutliers found;
    found.add(scales);
    if (!found.any()) return {};
    terms.outliers.add(scales);
    if (first + config_.micro_batch < config_.batch_size) {
        terms.waiting.push_back(first);
        return {};
    }
    return add_to_gradients(scales, terms.outliers);
}

Status Trainer::add_to_gradients(std::span<const float> scales, const ScaleOutliers& batch) {
    const vk::BufferView view = model_->output_gradients().scales;
    std::vector<float> gradients(scales.size());
    SPLAT_TRY(context_.read(view, gradients.data(), gradients.size() * sizeof(float)));
    add_scale_gradients(scales, batch, gradients);
    return context_.write(view, gradients.data(), gradients.size() * sizeof(float));
}

Status Trainer::repeat_for_scales(const TrainBatch& batch, std::uint32_t first,
                                  const ScaleOutliers& outliers) {
    SPLAT_TRY(forward(batch, first));
    const model::Model::Outputs gradients = model_->output_gradients();
    for (const vk::BufferView& view : {gradients.means, gradients.opacities, gradients.scales,
                                       gradients.rotations, gradients.sh})
        SPLAT_TRY(context_.fill(view, 0));
    const vk::BufferView view = model_->outputs().scales;
    std::vector<float> scales(view.shape.elements());
    SPLAT_TRY(context_.read(view, scales.data(), scales.size() * sizeof(float)));
    SPLAT_TRY(add_to_gradients(scales, outliers));
    return model_->backward();
}

}  // namespace splat::train
