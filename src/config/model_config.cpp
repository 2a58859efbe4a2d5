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

/// Refuse what LGM's network has no place for.
Status check_unused_by_lgm(const ModelConfig& c) {
    const std::pair<const char*, bool> unused[] = {
        {"data.use_pred_depth", c.depth},
        {"data.use_pred_normal", c.normal},
        {"data.use_mask", c.mask},
        {"data.use_pred_plane", c.plane},
        {"data.origin_distances", c.origin_distance},
        {"cam_embd.embedding", c.embedding != Embedding::kNone},
        {"model.token_dim", c.token_dim > 0},
        {"model.named_resolution", c.named_resolution != 0},
        {"opt.lora_finetune", c.lora.rank > 0},
        {"model.head.positions", c.positions == kHeadInputDepth},
    };
    for (const auto& [key, given] : unused)
        if (given)
            return invalid(
                "configuration: '%s' asks for what 'model.network' lgm_unet does not have; "
                "expected "
                "the key's default",
                key);
    if (c.fov_degrees == 0)
        return refuse_value("data.fov", 0,
                            "more than 0 where 'model.network' is lgm_unet: its rays are inputs");
    return {};
}

/// The lists of levels, from the image inwards and back.
Status check_lgm(const ModelConfig& c) {
    SPLAT_TRY(check_unused_by_lgm(c));
    const LgmUnetConfig& n = c.lgm;
    const auto levels = [](const char* key, std::size_t count, const char* other, std::size_t least,
                           std::size_t most) -> Status {
        if (count >= least && count <= most) return {};
        return invalid("configuration: '%s' has %zu levels, expected %zu to %zu%s", key, count,
                       least, most, other);
    };
    constexpr std::size_t kMostLevels = 8;
    SPLAT_TRY(levels("model.down", n.down.size(), "", 1, kMostLevels));
    SPLAT_TRY(levels("model.down_attention", n.down_attention.size(), ", as model.down",
                     n.down.size(), n.down.size()));
    SPLAT_TRY(levels("model.up", n.up.size(), ", at most those of model.down", 1, n.down.size()));
    SPLAT_TRY(levels("model.up_attention", n.up_attention.size(), ", as model.up", n.up.size(),
                     n.up.size()));
    const std::uint32_t stride = 1U << (n.down.size() - 1);
    if (c.resolution % stride != 0)
        return refuse_value("data.training_resolution", c.resolution,
                            format("a multiple of %u", stride).c_str());
    const auto widths = [](const char* key, const std::vector<std::uint32_t>& all,
                           const std::vector<std::uint32_t>& attention) -> Status {
        for (std::size_t i = 0; i < all.size(); ++i) {
            // Heads of whole quads of channels, as the operator takes them.
            const std::uint32_t unit =
                attention[i] != 0 ? 4 * LgmUnetConfig::kHeads : LgmUnetConfig::kGroups;
            if (all[i] % unit != 0)
                return refuse_value(key, all[i],
                                    format("multiples of %u, and of %u with attention",
                                           LgmUnetConfig::kGroups, 4 * LgmUnetConfig::kHeads)
                                        .c_str());
        }
        return {};
    };
    SPLAT_TRY(widths("model.down", n.down, n.down_attention));
    SPLAT_TRY(widths("model.up", n.up, n.up_attention));
    return widths("model.down", {n.down.back()}, {1});  // the middle always attends
}

/// The lists of levels of Splatter Image's network.
Status check_song(const ModelConfig& c) {
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
    for (const std::uint32_t mult : c.channel_mult)
        if (mult * c.base_dim > kMaxChannels)
            return refuse_value("model.channel_mult", mult, "no more than 4096 channels");
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
    return 3U + (depth ? 1U : 0U) + (normal ? 3U : 0U) + (mask ? 1U : 0U) + (plane ? 5U : 0U);
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
    SPLAT_TRY(c.network == Network::kLgmUnet ? check_lgm(c) : check_song(c));
    SPLAT_TRY(check_head(c));
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
