#include "vision/vit.h"

#include <algorithm>

namespace splat::vision {
namespace {

using nn::kNoValue;
using nn::ValueId;

constexpr double kTokenEps = 1e-6;

/// The tokens before the first block: [1,width,1,1 + rows * columns].
ValueId embed(Layers& layers, const std::string& name, const VitSizes& sizes,
              const VitValues& values, std::uint32_t rows, std::uint32_t columns) {
    nn::Graph& graph = layers.graph();
    const std::uint32_t side = sizes.side;
    const bool same = rows == side && columns == side;
    const auto factor = [&](std::uint32_t patches) { return same ? 1.0 : (patches + 0.1) / side; };
    const ValueId positions = graph.op("resize2d", {values.positions},
                                       {{"width", std::int64_t{columns}},
                                        {"height", std::int64_t{rows}},
                                        {"filter", std::int64_t{1}},
                                        {"scale_x", factor(columns)},
                                        {"scale_y", factor(rows)}});
    const ValueId patches = layers.patches(name + ".patch_embed.proj", values.image, sizes.width,
                                           sizes.patch, positions);
    if (!layers.ok()) return kNoValue;
    const std::uint32_t count = rows * columns;
    const ValueId behind = layers.pad(graph.reshape(patches, {1, sizes.width, 1, count}), {1});
    const ValueId first = layers.pad(values.first_token, {0, std::int64_t{count}});
    return graph.op("add", {behind, first});
}

ValueId token_block(Layers& layers, const std::string& name, const VitSizes& sizes, ValueId x) {
    nn::Graph& graph = layers.graph();
    ValueId h = layers.layer_norm(name + ".norm1", x, kTokenEps);
    const std::string qkv = name + ".attn.qkv";
    const ValueId q = layers.third(qkv, h, 0), k = layers.third(qkv, h, 1);
    h = graph.op("attention", {q, k, layers.third(qkv, h, 2)},
                 {{"heads", std::int64_t{sizes.heads}}});
    x = layers.linear(name + ".attn.proj", h, sizes.width, x, name + ".ls1.gamma");
    h = layers.layer_norm(name + ".norm2", x, kTokenEps);
    h = graph.op("gelu", {layers.linear(name + ".mlp.fc1", h, sizes.hidden)});
    return layers.linear(name + ".mlp.fc2", h, sizes.width, x, name + ".ls2.gamma");
}

}  // namespace

VitValues add_vit(Layers& layers, const std::string& name, const VitSizes& sizes,
                  std::uint32_t rows, std::uint32_t columns) {
    nn::Graph& graph = layers.graph();
    VitValues values;
    values.image = graph.input("image", {1, 3, rows * sizes.patch, columns * sizes.patch});
    values.positions = graph.input("positions", {1, sizes.width, sizes.side, sizes.side});
    values.first_token = graph.input("first_token", {1, sizes.width, 1, 1});
    const std::string backbone = name + ".backbone";
    ValueId x = embed(layers, backbone, sizes, values, rows, columns);
    const std::uint32_t count = rows * columns;
    // The final normalisation is shared by all taps, so its parameters are made once.
    ValueId gamma = kNoValue, beta = kNoValue;
    for (std::uint32_t i = 0, tap = 0; i < sizes.blocks && layers.ok(); ++i) {
        x = token_block(layers, backbone + ".blocks." + std::to_string(i), sizes, x);
        if (std::ranges::find(sizes.taps, i) == sizes.taps.end()) continue;
        ValueId y = kNoValue;
        if (tap == 0) {
            y = layers.layer_norm(backbone + ".norm", x, kTokenEps);
            gamma = graph.find(backbone + ".norm.weight");
            beta = graph.find(backbone + ".norm.bias");
        } else {
            y = graph.op("layer_norm", {x, gamma, beta}, {{"eps", kTokenEps}});
        }
        if (tap + 1 == sizes.taps.size())
            values.class_token = layers.pad(y, {0, -std::int64_t{count}});
        const ValueId patches = layers.pad(y, {-1});
        if (!layers.ok()) break;
        values.features = layers.conv1(name + ".output_projections." + std::to_string(tap++),
                                       graph.reshape(patches, {1, sizes.width, rows, columns}),
                                       sizes.features, values.features);
    }
    return values;
}

}  // namespace splat::vision
