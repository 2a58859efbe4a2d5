#include "model/song_unet.h"

#include <algorithm>

namespace splat::model {
namespace {

using nn::kNoValue;
using nn::ValueId;

constexpr float kSkipScale = 0.70710678F;  // sqrt(1/2): keeps the variance of a sum of two
constexpr double kEps = 1e-6;

const Init kXavier{Init::Kind::kXavierUniform, 1};
const Init kAlmostZero{Init::Kind::kXavierUniform, 1e-5F};
const Init kQkv{Init::Kind::kXavierUniform, 0.44721360F};  // sqrt(0.2)
const Init kOutput{Init::Kind::kXavierUniform, 0.2F};
const Init kZero{Init::Kind::kConstant, 0};
const Init kOne{Init::Kind::kConstant, 1};

std::string level_name(std::uint32_t resolution, const std::string& what) {
    const std::string r = std::to_string(resolution);
    return r + "x" + r + "_" + what;
}

}  // namespace

std::uint32_t norm_groups(std::uint32_t channels) {
    return std::max(1U, std::min(32U, channels / 4));
}

ValueId SongUnet::parameter(const std::string& name, const Shape& shape, const Init& init) {
    inits_[name] = init;
    const bool adapter = name.find("lora_") != std::string::npos;
    const bool chosen =
        config_.lora.rank == 0 || adapter || contains_any(name, config_.lora.trained);
    return graph_.parameter(name, shape, chosen && !contains_any(name, config_.frozen));
}

bool SongUnet::attends(std::uint32_t resolution) const {
    return std::ranges::find(config_.attention_resolutions, resolution) !=
           config_.attention_resolutions.end();
}

ValueId SongUnet::norm(const std::string& name, ValueId x, bool silu, int times) {
    if (!graph_.status().ok()) return kNoValue;
    const std::uint32_t c = channels(x);
    const std::uint32_t groups = norm_groups(c);
    if (c % groups != 0)
        graph_.fail(
            invalid("configuration: layer '%s' has %u channels, which do not divide into its "
                    "%u groups; model.base_dim is %u, a multiple of 32 divides everywhere",
                    name.c_str(), c, groups, config_.base_dim));
    const ValueId gamma = parameter(name + ".weight", {c}, kOne);
    const ValueId beta = parameter(name + ".bias", {c}, kZero);
    for (int time = 0; time < times; ++time)
        x = graph_.op("group_norm", {x, gamma, beta},
                      {{"groups", std::int64_t{groups}}, {"eps", kEps}, {"silu", silu}});
    return x;
}

ValueId SongUnet::convolve(ValueId x, ValueId weight, ValueId bias, ValueId residual,
                           double scale) {
    if (!graph_.status().ok()) return kNoValue;
    const auto precision = static_cast<std::int64_t>(options_.precision) + 1;  // 0: no table
    return graph_.op("conv2d", {x, weight, bias, residual},
                     {{"scale", scale}, {"precision", precision}});
}

/// The first of the two applies the factor alpha / rank: the second then only adds, which takes no extra
/// pass.
ValueId SongUnet::lora(const std::string& name, ValueId x, std::uint32_t out, std::uint32_t kernel,
                       ValueId residual) {
    if (!graph_.status().ok()) return kNoValue;
    const std::uint32_t c = channels(x);
    const std::uint32_t rank = config_.lora.rank;
    const ValueId a =
        parameter(name + ".lora_A", {rank, c * kernel * kernel}, {Init::Kind::kUniformColumns, 1});
    const ValueId b = parameter(name + ".lora_B", {out, rank}, kZero);
    const double scale = static_cast<double>(config_.lora.alpha) / std::max(1U, rank);
    const ValueId h =
        convolve(dropout(x, config_.lora.dropout), graph_.reshape(a, {rank, c, kernel, kernel}),
                 kNoValue, kNoValue, scale);
    return convolve(h, graph_.reshape(b, {out, rank, 1, 1}), kNoValue, residual, 1);
}

ValueId SongUnet::conv(const std::string& name, ValueId x, std::uint32_t out, std::uint32_t kernel,
                       const Init& init, ValueId residual, float scale, bool adapted,
                       const Init& bias_init) {
    if (!graph_.status().ok()) return kNoValue;
    const ValueId weight = parameter(name + ".weight", {out, channels(x), kernel, kernel}, init);
    const ValueId bias = parameter(name + ".bias", {out}, bias_init);
    if (adapted && config_.lora.rank > 0 && contains_any(name, config_.lora.targets))
        residual = lora(name, x, out, kernel, residual);
    return convolve(x, weight, bias, residual, static_cast<double>(scale));
}

ValueId SongUnet::linear(const std::string& name, ValueId x, std::uint32_t out, const Init& bias) {
    if (!graph_.status().ok()) return kNoValue;
    const Shape shape = graph_.value(x).shape;
    const ValueId weight = parameter(name + ".weight", {out, shape[1]}, kXavier);
    const ValueId y = graph_.op("linear", {x, weight, parameter(name + ".bias", {out}, bias)});
    if (config_.lora.rank == 0 || !contains_any(name, config_.lora.targets)) return y;
    // The adapter's convolutions, which also scale and add, see rows as images of one pixel.
    const ValueId sum = lora(name, graph_.reshape(x, {shape[0], shape[1], 1, 1}), out, 1,
                             graph_.reshape(y, {shape[0], out, 1, 1}));
    return graph_.reshape(sum, {shape[0], out});
}

ValueId SongUnet::resample(ValueId x, bool up) {
    return graph_.op("resample2d", {x}, {{"up", up}, {"down", !up}});
}

ValueId SongUnet::dropout(ValueId x, float p) {
    if (!options_.training || p == 0) return x;
    return graph_.op("dropout", {x, counter_},
                     {{"p", static_cast<double>(p)}, {"stream", dropouts_++}});
}

/// The block's second normalisation and activation, with the embedding's part.
ValueId SongUnet::modulate(const std::string& name, ValueId x, std::uint32_t c) {
    if (embedding_ == kNoValue) return norm(name + ".norm1", x, true);
    if (config_.film == Film::kAffine) {
        const ValueId modulation =
            linear(name + ".affine", embedding_, 2 * c, {Init::Kind::kFilmBias, 1});
        x = graph_.op("film", {norm(name + ".norm1", x, false), modulation});
        return graph_.op("silu", {x});
    }
    x = graph_.op("film", {x, linear(name + ".affine", embedding_, c)});
    // The published code normalises and activates twice with the same weights; its weights depend on it.
    return norm(name + ".norm1", x, true, 2);
}

/// A residual block: y = (conv1(act(norm1(conv0(act(norm0(x)))))) + skip(x)) / sqrt(2), then attention.
ValueId SongUnet::block(const std::string& name, ValueId x, const BlockShape& shape) {
    if (!graph_.status().ok()) return kNoValue;
    const bool resamples = shape.up || shape.down;
    ValueId original = x;
    x = norm(name + ".norm0", x, true);
    if (resamples) {
        x = resample(x, shape.up);
        original = resample(original, shape.up);
    }
    x = conv(name + ".conv0", x, shape.out, 3, kXavier, kNoValue, 1, !resamples);
    if (!graph_.status().ok()) return kNoValue;
    x = modulate(name, x, shape.out);
    x = dropout(x, config_.dropout);
    if (resamples || shape.in != shape.out)
        original = conv(name + ".skip", original, shape.out, 1, kXavier);
    x = conv(name + ".conv1", x, shape.out, 3, kAlmostZero, original, kSkipScale, true);
    if (shape.attention) x = self_attention(name, x);
    if (shape.tokens && tokens_ != kNoValue) x = token_attention(name, x);
    return x;
}

/// Attention over all pixels, and over all views of an object if views attend to each other: these are
/// then stacked in one image, which is the same memory.
ValueId SongUnet::self_attention(const std::string& name, ValueId x) {
    if (!graph_.status().ok()) return kNoValue;
    const Shape shape = graph_.value(x).shape;
    const bool across = config_.views > 1 && config_.cross_view_attention;
    if (across)
        x = graph_.reshape(
            x, {shape[0] / config_.views, shape[1], config_.views * shape[2], shape[3]});
    const ValueId y = x;
    const ValueId qkv = conv(name + ".qkv", norm(name + ".norm2", x, false), 3 * shape[1], 1, kQkv,
                             kNoValue, 1, true);
    const std::vector<ValueId> parts = graph_.node("split3", {qkv});
    x = graph_.op("attention", {parts[0], parts[1], parts[2]});
    x = conv(name + ".proj", x, shape[1], 1, kAlmostZero, y, kSkipScale, true);
    return across ? graph_.reshape(x, shape) : x;
}

/// In the bottleneck (in0) and in the decoder's blocks with attention. Pixels are queries, tokens keys and
/// values: y = x + out(attention(q(norm(x)), k(tokens), v(tokens))). `out` starts at zero, so that adding
/// it changes nothing at first.
ValueId SongUnet::token_attention(const std::string& name, ValueId x) {
    if (!graph_.status().ok()) return kNoValue;
    const std::uint32_t c = channels(x);
    const std::string at = name + ".cross_attention";
    const ValueId q = conv(at + ".q_proj", norm(at + ".norm", x, false), c, 1, kXavier);
    const ValueId k = conv(at + ".k_proj", tokens_, c, 1, kXavier);
    const ValueId v = conv(at + ".v_proj", tokens_, c, 1, kXavier);
    const ValueId attended = graph_.op("attention", {q, k, v});
    return conv(at + ".out_proj", attended, c, 1, kZero, x);
}

ValueId SongUnet::encode(ValueId x, std::vector<ValueId>& skips) {
    const std::string enc = std::string(config_.network_name()) + ".encoder.enc.";
    std::uint32_t c = config_.base_dim;
    for (std::uint32_t level = 0; level < config_.levels(); ++level) {
        const std::uint32_t r = config_.names_resolution() >> level;
        graph_.begin_segment();
        if (level == 0) {
            x = conv(enc + level_name(r, "conv"), x, c, 3, kXavier, kNoValue, 1, true);
        } else {
            x = block(enc + level_name(r, "down"), x, {c, c, false, true, false});
        }
        skips.push_back(x);
        for (std::uint32_t i = 0; i < config_.num_blocks; ++i) {
            const std::uint32_t out = config_.base_dim * config_.channel_mult[level];
            graph_.begin_segment();
            x = block(enc + level_name(r, "block" + std::to_string(i)), x,
                      {c, out, false, false, attends(r)});
            c = out;
            skips.push_back(x);
        }
    }
    return x;
}

ValueId SongUnet::decode(ValueId x, std::vector<ValueId>& skips) {
    const std::string dec = std::string(config_.network_name()) + ".encoder.dec.";
    std::uint32_t c = config_.base_dim * config_.channel_mult.back();
    for (std::uint32_t level = config_.levels(); level-- > 0;) {
        const std::uint32_t r = config_.names_resolution() >> level;
        graph_.begin_segment();
        if (level + 1 == config_.levels()) {
            x = block(dec + level_name(r, "in0"), x, {c, c, false, false, true, true});
            graph_.begin_segment();
            x = block(dec + level_name(r, "in1"), x, {c, c, false, false, false});
        } else {
            x = block(dec + level_name(r, "up"), x, {c, c, true, false, false});
        }
        for (std::uint32_t i = 0; i <= config_.num_blocks; ++i) {
            if (!graph_.status().ok()) return kNoValue;
            graph_.begin_segment();
            x = graph_.op("concat", {x, skips.back()});
            skips.pop_back();
            if (!graph_.status().ok()) return kNoValue;
            const std::uint32_t out = config_.base_dim * config_.channel_mult[level];
            const bool attention = i == config_.num_blocks && attends(r);  // only the last block
            x = block(dec + level_name(r, "block" + std::to_string(i)), x,
                      {channels(x), out, false, false, attention, attention});
            c = out;
        }
    }
    graph_.begin_segment();
    const std::uint32_t r = config_.names_resolution();
    x = norm(dec + level_name(r, "aux_norm"), x, true);
    return conv(dec + level_name(r, "aux_conv"), x, config_.output_channels(), 3, kOutput);
}

ValueId SongUnet::build(ValueId x, ValueId embedding, ValueId tokens, ValueId counter) {
    tokens_ = tokens;
    counter_ = counter;
    if (embedding != kNoValue) {
        const std::uint32_t width = 4 * config_.base_dim;
        const std::string map = std::string(config_.network_name()) + ".encoder.map_layer";
        embedding = graph_.op("silu", {linear(map + "0", embedding, width)});
        embedding_ = graph_.op("silu", {linear(map + "1", embedding, width)});
    }
    std::vector<ValueId> skips;
    x = encode(x, skips);
    if (!graph_.status().ok()) return kNoValue;
    x = decode(x, skips);
    if (!graph_.status().ok()) return kNoValue;
    x = conv(config_.network_name() + std::string(".out"), x, config_.output_channels(), 1,
             {Init::Kind::kHeadWeight, 0}, kNoValue, 1, false, {Init::Kind::kHeadBias, 0});
    graph_.fail(check_names());
    return x;
}

Status SongUnet::check_names() const {
    SPLAT_TRY(check_parts(inits_, "opt.freeze", config_.frozen, ""));
    if (config_.lora.rank == 0) return {};
    SPLAT_TRY(check_parts(inits_, "opt.lora_targets", config_.lora.targets, ".lora_A"));
    return check_parts(inits_, "opt.train_with_adapters", config_.lora.trained, "");
}

}  // namespace splat::model
