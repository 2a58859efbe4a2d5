#include "model/lgm_unet.h"

#include <algorithm>

namespace splat::model {
namespace {

using nn::kNoValue;
using nn::ValueId;

constexpr double kRootOfHalf =
    0.70710678118654752;  // sqrt(1/2): keeps the variance of a sum of two
constexpr double kNormEps = 1e-5;

/// PyTorch's initial weights of convolutions and linear layers; biases start at zero here, as everywhere in this layer.
const Init kWeight{Init::Kind::kUniformColumns, 1};
const Init kNoBias{Init::Kind::kConstant, 0};
const Init kUnitGain{Init::Kind::kConstant, 1};

std::string numbered(const std::string& name, std::size_t number) {
    return name + "." + std::to_string(number);
}

}  // namespace

ValueId LgmUnet::parameter(const std::string& name, const Shape& shape, const Init& init) {
    inits_[name] = init;
    return graph_.parameter(name, shape, !contains_any(name, config_.frozen));
}

/// y = x * weight + bias, or (that + residual) / sqrt(2).
ValueId LgmUnet::convolve(ValueId x, ValueId weight, ValueId bias, ValueId residual) {
    if (!graph_.status().ok()) return kNoValue;
    const auto precision = static_cast<std::int64_t>(options_.precision) + 1;  // 0: no table
    return graph_.op("conv2d", {x, weight, bias, residual},
                     {{"scale", residual == kNoValue ? 1 : kRootOfHalf}, {"precision", precision}});
}

ValueId LgmUnet::conv(const std::string& name, ValueId x, std::uint32_t out, std::uint32_t kernel,
                      ValueId residual) {
    if (!graph_.status().ok()) return kNoValue;
    const ValueId weight = parameter(name + ".weight", {out, channels(x), kernel, kernel}, kWeight);
    return convolve(x, weight, parameter(name + ".bias", {out}, kNoBias), residual);
}

/// A product for the channels of each pixel; the published weight has two dimensions.
ValueId LgmUnet::linear(const std::string& name, ValueId x, std::uint32_t out, bool bias,
                        ValueId residual) {
    if (!graph_.status().ok()) return kNoValue;
    const std::uint32_t c = channels(x);
    const ValueId weight = parameter(name + ".weight", {out, c}, kWeight);
    return convolve(x, graph_.reshape(weight, {out, c, 1, 1}),
                    bias ? parameter(name + ".bias", {out}, kNoBias) : kNoValue, residual);
}

ValueId LgmUnet::norm(const std::string& name, ValueId x, bool silu) {
    if (!graph_.status().ok()) return kNoValue;
    const std::uint32_t c = channels(x);
    return graph_.op(
        "group_norm",
        {x, parameter(name + ".weight", {c}, kUnitGain), parameter(name + ".bias", {c}, kNoBias)},
        {{"groups", std::int64_t{config::LgmUnetConfig::kGroups}},
         {"eps", kNormEps},
         {"silu", silu}});
}

/// y = (conv2(silu(norm2(conv1(silu(norm1(x)))))) + shortcut(x)) / sqrt(2).
ValueId LgmUnet::net(const std::string& name, ValueId x, std::uint32_t out) {
    if (!graph_.status().ok()) return kNoValue;
    const ValueId h = conv(name + ".conv1", norm(name + ".norm1", x, true), out, 3);
    if (!graph_.status().ok()) return kNoValue;
    const ValueId activated = norm(name + ".norm2", h, true);
    if (channels(x) != out) x = conv(name + ".shortcut", x, out, 1);
    return conv(name + ".conv2", activated, out, 3, x);
}

/// Attention over all pixels of all views of an object, which are then one high image: the same memory.
ValueId LgmUnet::attention(const std::string& name, ValueId x) {
    if (!graph_.status().ok()) return kNoValue;
    const Shape shape = graph_.value(x).shape;
    const std::uint32_t c = shape[1];
    const ValueId qkv = linear(name + ".attn.qkv", norm(name + ".norm", x, false), 3 * c, false);
    if (!graph_.status().ok()) return kNoValue;
    const ValueId tokens =
        graph_.reshape(qkv, {shape[0] / config_.views, 3 * c, config_.views * shape[2], shape[3]});
    const std::vector<ValueId> parts = graph_.node("split3", {tokens}, {{"stacked", true}});
    if (!graph_.status().ok()) return kNoValue;
    const ValueId y = graph_.op("attention", {parts[0], parts[1], parts[2]},
                                {{"heads", std::int64_t{config::LgmUnetConfig::kHeads}}});
    if (!graph_.status().ok()) return kNoValue;
    return linear(name + ".attn.proj", graph_.reshape(y, shape), c, true, x);
}

/// One net of a block, and its attention if the block has any.
ValueId LgmUnet::layer(const std::string& block, int number, ValueId x, std::uint32_t out,
                       bool attends) {
    const auto of = [&](const char* what) {
        return numbered(block + what, static_cast<std::size_t>(number));
    };
    graph_.begin_segment();
    x = net(of(".nets"), x, out);
    if (!attends) return x;
    graph_.begin_segment();
    return attention(of(".attns"), x);
}

ValueId LgmUnet::encode(ValueId x, std::vector<ValueId>& skips) {
    const config::LgmUnetConfig& c = config_.lgm;
    // This filter of resample2d takes every second pixel: a convolution and it together have a stride of 2.
    const ValueId even = graph_.input("even", {2}, ops::Layout::kRowMajor);
    constants_.push_back({even, {1, 0}});
    graph_.begin_segment();
    x = conv("unet.conv_in", x, c.down[0], 3);
    skips.push_back(x);
    for (std::size_t level = 0; level < c.down.size(); ++level) {
        const std::string block = numbered("unet.down_blocks", level);
        for (int i = 0; i < config::LgmUnetConfig::kDownNets; ++i) {
            x = layer(block, i, x, c.down[level], c.down_attention[level] != 0);
            skips.push_back(x);
        }
        if (level + 1 == c.down.size()) break;
        graph_.begin_segment();
        x = conv(block + ".downsample", x, c.down[level], 3);
        x = graph_.op("resample2d", {x, even}, {{"down", true}});
        skips.push_back(x);
    }
    return x;
}

ValueId LgmUnet::decode(ValueId x, std::vector<ValueId>& skips) {
    const config::LgmUnetConfig& c = config_.lgm;
    for (std::size_t level = 0; level < c.up.size(); ++level) {
        const std::string block = numbered("unet.up_blocks", level);
        for (int i = 0; i <= config::LgmUnetConfig::kDownNets; ++i) {
            graph_.begin_segment();
            x = graph_.op("concat", {x, skips.back()});
            skips.pop_back();
            x = layer(block, i, x, c.up[level], c.up_attention[level] != 0);
        }
        if (level + 1 == c.up.size()) break;
        graph_.begin_segment();
        x = graph_.op("resample2d", {x}, {{"up", true}});
        x = conv(block + ".upsample", x, c.up[level], 3);
    }
    return x;
}

ValueId LgmUnet::turned(ValueId raw) {
    const HeadLayout head = config_.head();
    if (!graph_.status().ok() || !head.absolute()) return raw;
    const Shape shape = graph_.value(raw).shape;
    const std::uint32_t c = shape[1], one = head.channels_of_one();
    // Factors, then summands, of each channel: half a turn about x.
    std::vector<float> row(std::size_t{2} * c);
    std::fill_n(row.begin(), c, 1.0F);
    for (std::uint32_t first = 0; first < c; first += one)
        for (const std::uint32_t at : {head.at(kHeadPoint) + 1, head.at(kHeadPoint) + 2,
                                       head.at(kHeadRotation) + 2, head.at(kHeadRotation) + 3})
            row[first + at] = -1;
    std::vector<float> rows;
    for (std::uint32_t i = 0; i < shape[0]; ++i) rows.insert(rows.end(), row.begin(), row.end());
    const ValueId axes = graph_.input("axes", {shape[0], 2 * c});
    constants_.push_back({axes, std::move(rows)});
    return graph_.op("film", {raw, axes});
}

ValueId LgmUnet::build(ValueId x) {
    std::vector<ValueId> skips;
    x = encode(x, skips);
    const std::uint32_t deepest = config_.lgm.down.back();
    x = layer("unet.mid_block", 0, x, deepest, true);
    x = layer("unet.mid_block", 1, x, deepest, false);
    x = decode(x, skips);
    graph_.begin_segment();
    const std::uint32_t out = config_.output_channels();
    x = conv("unet.conv_out", norm("unet.norm_out", x, true), out, 3);
    if (!graph_.status().ok()) return kNoValue;
    const ValueId weight = parameter("conv.weight", {out, out, 1, 1}, {Init::Kind::kHeadWeight, 0});
    x = convolve(x, weight, parameter("conv.bias", {out}, {Init::Kind::kHeadBias, 0}), kNoValue);
    graph_.fail(check_parts(inits_, "opt.freeze", config_.frozen, ""));
    return x;
}

}  // namespace splat::model
