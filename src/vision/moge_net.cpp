#include "vision/moge_net.h"

#include <algorithm>
#include <cmath>

namespace splat::vision {
namespace {

using nn::kNoValue;
using nn::ValueId;

constexpr double kNormEps = 1e-5;
constexpr std::uint32_t kGroup = 32;  ///< channels of a group

ValueId norm(Layers& layers, const std::string& name, ValueId x, BlockNorm kind) {
    if (kind == BlockNorm::kNone || !layers.ok()) return x;
    const std::uint32_t groups =
        kind == BlockNorm::kLayer ? 1 : std::max(1U, layers.channels(x) / kGroup);
    return layers.group_norm(name, x, groups, kNormEps);
}

ValueId residual_block(Layers& layers, const std::string& name, const StackSizes& stack,
                       ValueId x) {
    if (!layers.ok()) return kNoValue;
    nn::Graph& graph = layers.graph();
    const std::uint32_t c = layers.channels(x);
    ValueId h = graph.op("relu", {norm(layers, name + ".layers.0", x, stack.in_norm)});
    h = layers.conv3(name + ".layers.2", h, c);
    h = graph.op("relu", {norm(layers, name + ".layers.3", h, stack.hidden_norm)});
    return layers.conv3(name + ".layers.5", h, c, x);
}

/// To the next level.
ValueId up(Layers& layers, const std::string& name, bool transposed, ValueId x, std::uint32_t out) {
    if (!layers.ok()) return kNoValue;
    if (transposed) {
        x = layers.transposed(name + ".0", x, out);
    } else {
        const Shape shape = layers.graph().value(x).shape;
        x = layers.graph().op(
            "resize2d", {x},
            {{"width", std::int64_t{2} * shape[3]}, {"height", std::int64_t{2} * shape[2]}});
    }
    return layers.conv3(name + ".1", x, out);
}

/// The values of the first `count` levels.
std::vector<ValueId> add_stack(Layers& layers, const StackSizes& stack,
                               const std::vector<ValueId>& inputs, std::size_t count) {
    std::vector<ValueId> levels;
    ValueId x = kNoValue;
    for (std::size_t l = 0; l < count && layers.ok(); ++l) {
        const std::string level = std::to_string(l);
        if (l > 0)
            x = up(layers, stack.name + ".resamplers." + std::to_string(l - 1),
                   stack.transposed[l - 1], x, stack.widths[l]);
        x = layers.conv1(stack.name + ".input_blocks." + level, inputs[l], stack.widths[l], x);
        for (std::uint32_t b = 0; b < stack.blocks[l]; ++b)
            x = residual_block(
                layers, stack.name + ".res_blocks." + level + "." + std::to_string(b), stack, x);
        levels.push_back(x);
    }
    return levels;
}

/// True if the last level has no activation.
bool last_is_linear(const StackSizes& stack) {
    return stack.blocks.back() == 0 && !stack.transposed.back();
}

/// Tensors of a layer in the file.
struct FileLayer {
    Source weight, bias;
};
FileLayer file_layer(const std::string& name, std::uint32_t out, std::uint32_t in,
                     std::int64_t kernel) {
    return {{name + ".weight", {out, in, kernel, kernel}}, {name + ".bias", {out}}};
}

/// A head's result from the values of the neck and the head at the level before the last, and the coordinates: the last
/// levels of both and the output are one layer, whose convolutions give the result's few channels.
ValueId linear_level(Layers& layers, const StackSizes& neck, const StackSizes& head, ValueId neck_x,
                     ValueId head_x, ValueId view) {
    const std::size_t last = head.widths.size() - 1;
    const auto input = [&](const StackSizes& stack) {
        return file_layer(stack.name + ".input_blocks." + std::to_string(last), stack.widths[last],
                          stack.inputs[last], 1);
    };
    const auto up = [&](const StackSizes& stack) {
        return file_layer(stack.name + ".resamplers." + std::to_string(last - 1) + ".1",
                          stack.widths[last], stack.widths[last - 1], 3);
    };
    const auto [out, out_bias] = file_layer(head.name + ".output_blocks." + std::to_string(last),
                                            head.out, head.widths[last], 1);
    const FileLayer own_up = up(head), own_input = input(head);
    const FileLayer neck_up = up(neck), neck_input = input(neck);
    const Source& in = own_input.weight;
    const std::string name = head.name + ".last.";
    ValueId x = layers.conv3_of_twice(name + "own", head_x, head.out, {{out, own_up.weight}});
    x = layers.conv3_of_twice(name + "neck", neck_x, head.out, {{out, in, neck_up.weight}}, x);
    x = layers.graph().op("patches2d", {x}, {{"size", std::int64_t{2}}, {"up", true}});
    return layers.conv1_of(name + "view", view, head.out, {{out, in, neck_input.weight}},
                           {{out_bias},
                            {out, own_up.bias},
                            {out, own_input.bias},
                            {out, in, neck_up.bias},
                            {out, in, neck_input.bias}},
                           x);
}

}  // namespace

MogeValues add_moge(Layers& layers, const MogeSizes& sizes, std::uint32_t rows,
                    std::uint32_t columns) {
    nn::Graph& graph = layers.graph();
    MogeValues values;
    for (std::uint32_t l = 0; l < sizes.levels(); ++l)
        values.views.push_back(
            graph.input("view" + std::to_string(l), {1, 2, rows << l, columns << l}));
    values.encoder = add_vit(layers, "encoder", sizes.encoder, rows, columns);
    std::vector<ValueId> inputs = values.views;
    inputs[0] = graph.op("concat", {values.encoder.features, values.views[0]});
    const bool linear =
        last_is_linear(sizes.neck) && std::ranges::all_of(sizes.heads, last_is_linear);
    const std::size_t last = sizes.levels() - 1, count = linear ? last : last + 1;
    const std::vector<ValueId> neck = add_stack(layers, sizes.neck, inputs, count);
    for (const StackSizes& head : sizes.heads) {
        const std::vector<ValueId> levels = add_stack(layers, head, neck, count);
        if (!layers.ok()) return values;
        values.heads.push_back(
            linear ? linear_level(layers, sizes.neck, head, neck.back(), levels.back(),
                                  values.views[last])
                   : layers.conv1(head.name + ".output_blocks." + std::to_string(last),
                                  levels.back(), head.out));
    }
    ValueId x = values.encoder.class_token;
    for (std::size_t i = 0; i < sizes.scale.size(); ++i) {
        if (i > 0) x = graph.op("relu", {x});
        x = layers.linear("scale_head." + std::to_string(2 * i), x, sizes.scale[i]);
    }
    values.scale = x;
    return values;
}

std::vector<float> view_plane(std::uint32_t width, std::uint32_t height, double aspect) {
    const double diagonal = std::hypot(1.0, aspect);
    const auto at = [](std::uint32_t i, std::uint32_t n, double span) {
        return static_cast<float>(span * (2.0 * i + 1 - n) / n);
    };
    const std::size_t area = std::size_t{width} * height;
    std::vector<float> plane(2 * area);
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) {
            const std::size_t i = std::size_t{y} * width + x;
            plane[i] = at(x, width, aspect / diagonal);
            plane[area + i] = at(y, height, 1 / diagonal);
        }
    return plane;
}

}  // namespace splat::vision
