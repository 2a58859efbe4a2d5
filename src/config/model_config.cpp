#include "config/model_config.h"

#include <cmath>

#include "config/key_field.h"

namespace splat::config {
namespace {

/// The kernels are tested with 3x3 convolutions of at most this many channels.
constexpr std::uint32_t kMaxChannels = 4096;

Status refuse_value(const char* key, double value, const char* expected) {
    return invalid("configuration: '%s' is %g, expected %s", key, value, expected);
}

/// The range that each key has in the table.
Status check_ranges(const ModelConfig& c) {
    const Settings settings{c, {}};
    for (const Key& key : all_keys()) {
        const bool network = key.field.part == Part::kNetwork || key.field.part == Part::kAdapters;
        if (!network || key.field.write == nullptr) continue;
        for (const ConfigScalar& value : key.field.write(key, settings).values) {
            if (const auto* whole = std::get_if<std::int64_t>(&value))
                SPLAT_TRY(check_range("configuration", key, static_cast<double>(*whole)));
            if (const auto* real = std::get_if<double>(&value))
                SPLAT_TRY(check_range("configuration", key, *real));
        }
    }
    return {};
}

/// What the scale's activation turns into `scale`.
float scale_channel(std::uint32_t activation, float scale) {
    if (activation != kHeadSoftplus) return std::log(scale);
    // log(e^10s - 1), whose e^10s float32 does not hold.
    return 10 * scale + std::log(-std::expm1(-10 * scale));
}

Status check_head(const ModelConfig& c) {
    if (c.direct && c.sh_degree != 0)
        return refuse_value("model.max_sh_degree", c.sh_degree,
                            "0, as 'model.head.colours' are direct");
    if (c.origin_distance && c.positions != kHeadRayDepth)
        return refuse_value("data.origin_distances", 1,
                            "false: 'model.head.positions' have no depth that it is added to");
    return {};
}

}  // namespace

std::uint32_t ModelConfig::image_channels() const {
    if (network == Network::kLgmUnet) return 3 + 6;
    return 3U + (depth ? 1U : 0U) + (normal ? 3U : 0U) + (mask ? 1U : 0U);
}

std::uint32_t ModelConfig::input_channels() const {
    return image_channels() + (origin_distance || positions == kHeadInputDepth ? 1U : 0U);
}

std::uint32_t ModelConfig::output_resolution() const {
    if (network != Network::kLgmUnet) return resolution;
    return resolution >> (lgm.down.size() - lgm.up.size());
}

HeadLayout ModelConfig::head() const {
    const bool absolute = positions == kHeadBox;
    HeadLayout made({.positions = positions,
                     .offset = offset,
                     .least = absolute ? -box : znear,
                     .most = absolute ? box : zfar,
                     .scales = scales,
                     .isotropic = isotropic,
                     .sh_degree = sh_degree,
                     .direct = direct,
                     .per_pixel = per_pixel});
    const auto start = [&](HeadBlockId block, float gain, float bias) {
        made.blocks[block].gain = gain;
        made.blocks[block].bias = bias;
    };
    start(kHeadDepth, init_depth.scale, init_depth.bias);
    start(kHeadPoint, init_offset.scale, init_offset.bias);
    start(kHeadOpacity, init_opacity.scale, init_opacity.bias);
    start(kHeadScale, init_scale.scale, scale_channel(scales, init_scale.bias));
    return made;
}

std::uint32_t ModelConfig::embedding_length() const {
    switch (embedding) {
        case Embedding::kNone:
            return 0;
        case Embedding::kIndex:  // one scalar, the index of the view
            return embedding_dim;
        default:  // six scalars of the pose, or a vector of that length
            return 6 * embedding_dim;
    }
}

Status check(const ModelConfig& c) {
    SPLAT_TRY(check_ranges(c));
    if (c.levels() < 1 || c.levels() > 8)
        return invalid("configuration: 'model.channel_mult' has %u levels, expected 1 to 8",
                       c.levels());
    const std::uint32_t stride = 1U << (c.levels() - 1);
    if (c.resolution % stride != 0)
        return refuse_value("data.training_resolution", c.resolution,
                            format("a multiple of %u", stride).c_str());
    if (c.named_resolution % stride != 0)
        return refuse_value("model.named_resolution", c.named_resolution,
                            format("0 or a multiple of %u", stride).c_str());
    SPLAT_TRY(check_head(c));
    for (const std::uint32_t mult : c.channel_mult)
        if (mult * c.base_dim > kMaxChannels)
            return refuse_value("model.channel_mult", mult, "no more than 4096 channels");
    if (c.embedding != Embedding::kNone &&
        (c.embedding_dim < 2 || c.embedding_dim % 2 != 0 || c.embedding_dim > 64))
        return refuse_value("cam_embd.dimension", c.embedding_dim, "an even number up to 64");
    if ((c.token_dim > 0) != (c.tokens > 0))
        return refuse_value("model.tokens", c.tokens,
                            "a count where model.token_dim is given, else 0");
    if (c.znear <= 0 && !c.origin_distance)
        return refuse_value("data.znear", static_cast<double>(c.znear),
                            "more than 0, as no distance of the origin is added");
    if (c.znear >= c.zfar)
        return refuse_value("data.zfar", static_cast<double>(c.zfar), "more than data.znear");
    return {};
}

}  // namespace splat::config
