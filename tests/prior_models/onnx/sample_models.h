#pragma once

#include "prior_models/onnx/onnx_graph.h"

namespace splat::test {

/// A sum of the channels of an input pixel, and a constant: what the sample models compute.
struct ChannelSum {
    float weights[3], bias;
};

/// One of each output of sample_model(), channel by channel.
inline constexpr ChannelSum kSampleDepth = {{0.5F, -0.25F, 1.5F}, 0.125F};
inline constexpr ChannelSum kSampleMask = {{-1.5F, 0.75F, 0.25F}, 0.5F};
inline constexpr ChannelSum kSampleNormals[] = {
    {{1, 0.25F, 0}, 0.5F}, {{0, 1, -0.5F}, -0.25F}, {{0.125F, 0, -1}, -0.5F}};
inline constexpr ChannelSum kSamplePoints[] = {
    {{0.5F, 0, 0.25F}, -0.25F}, {{0, 0.5F, 0.25F}, -0.5F}, {{0.25F, 0.25F, 0.25F}, 1}};

/// A small model with the inputs and outputs of a preset: names, order, ranks, layout and size. Its outputs are
/// sums of channels, pixel by pixel.
OnnxGraph sample_model(const std::string& preset);

}  // namespace splat::test
