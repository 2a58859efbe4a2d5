#include "prior_models/onnx/sample_models.h"

#include <span>

namespace splat::test {
namespace {

/// Adds a 1 x 1 convolution of `from` with a channel for each sum.
void add_sums(OnnxGraph& graph, const std::string& from, const std::string& to,
              std::span<const ChannelSum> sums) {
    std::vector<float> weights, biases;
    for (const ChannelSum& sum : sums) {
        weights.insert(weights.end(), sum.weights, sum.weights + 3);
        biases.push_back(sum.bias);
    }
    const auto count = static_cast<std::int64_t>(sums.size());
    graph.floats(to + ".weight", {count, 3, 1, 1}, weights).floats(to + ".bias", {count}, biases);
    graph.node("Conv", {from, to + ".weight", to + ".bias"}, to);
}

OnnxGraph depth_model() {
    OnnxGraph graph;
    graph.input("pixel_values", kOnnxFloat, {-1, 3, -1, -1});
    add_sums(graph, "pixel_values", "planes", {&kSampleDepth, 1});
    graph.whole("axes", {1}).node("Squeeze", {"planes", "axes"}, "predicted_depth");
    graph.output("predicted_depth", kOnnxFloat, {-1, -1, -1});
    return graph;
}

/// The last of two outputs has a fourth channel, kappa.
OnnxGraph normal_model() {
    OnnxGraph graph;
    graph.input("img", kOnnxFloat, {1, 3, 512, 512});
    std::vector<ChannelSum> sums(std::begin(kSampleNormals), std::end(kSampleNormals));
    sums.push_back({{9, 9, 9}, 9});
    add_sums(graph, "img", "norm_out", sums);
    graph.node("MaxPool", {"norm_out"}, "coarse", {{"kernel_shape", {2, 2}}, {"strides", {2, 2}}});
    graph.output("coarse", kOnnxFloat, {1, 4, 256, 256});
    graph.output("norm_out", kOnnxFloat, {1, 4, 512, 512});
    return graph;
}

OnnxGraph moge_model() {
    OnnxGraph graph;
    graph.input("image", kOnnxFloat, {-1, 3, -1, -1}).input("num_tokens", kOnnxInt64, {});
    const OnnxAttribute last{"perm", {0, 2, 3, 1}};
    add_sums(graph, "image", "point_planes", kSamplePoints);
    graph.node("Transpose", {"point_planes"}, "points", {last});
    add_sums(graph, "image", "normal_planes", kSampleNormals);
    graph.node("Transpose", {"normal_planes"}, "normal", {last});
    add_sums(graph, "image", "mask_planes", {&kSampleMask, 1});
    graph.whole("axes", {1}).node("Squeeze", {"mask_planes", "axes"}, "mask_numbers");
    graph.node("Sigmoid", {"mask_numbers"}, "mask");
    // The scale is that of 3600 tokens only.
    graph.node("Cast", {"num_tokens"}, "tokens", {{"to", {kOnnxFloat}, false}});
    graph.floats("most", {}, {3600}).node("Div", {"tokens", "most"}, "part");
    graph.whole("first", {0}).node("Unsqueeze", {"part", "first"}, "scale");
    graph.output("points", kOnnxFloat, {-1, -1, -1, 3})
        .output("normal", kOnnxFloat, {-1, -1, -1, 3});
    graph.output("mask", kOnnxFloat, {-1, -1, -1}).output("scale", kOnnxFloat, {1});
    return graph;
}

/// A mask, and another output before or behind it. `sigmoid`: inside the model.
OnnxGraph mask_model(std::int64_t side, bool sigmoid, bool last) {
    OnnxGraph graph;
    graph.input("input", kOnnxFloat, {1, 3, side, side});
    add_sums(graph, "input", sigmoid ? "numbers" : "d0", {&kSampleMask, 1});
    if (sigmoid) graph.node("Sigmoid", {"numbers"}, "d0");
    graph.node("Neg", {"d0"}, "d1");
    for (const char* name : {last ? "d1" : "d0", last ? "d0" : "d1"})
        graph.output(name, kOnnxFloat, {1, 1, side, side});
    return graph;
}

}  // namespace

OnnxGraph sample_model(const std::string& preset) {
    if (preset.rfind("midas", 0) == 0) return depth_model();
    if (preset.rfind("normal", 0) == 0) return normal_model();
    if (preset.rfind("moge", 0) == 0) return moge_model();
    if (preset == "birefnet") return mask_model(384, false, true);
    if (preset == "birefnet-general") return mask_model(1024, false, false);
    return mask_model(preset == "u2net" ? 320 : 1024, true, false);
}

}  // namespace splat::test
