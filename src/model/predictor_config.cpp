#include "model/predictor_config.h"

#include <cmath>

namespace splat::model {
namespace {

/// 3x3 convolutions of so many channels are the most that the kernels are tested with.
constexpr std::uint32_t kMaxChannels = 4096;
constexpr std::uint32_t kMaxResolution = 4096;

Status refuse(const char* field, double value, const char* expected) {
    return error(Code::kInvalidArgument, "configuration: %s is %g, expected %s", field, value,
                 expected);
}

Status check_geometry(const PredictorConfig& c) {
    if (c.sh_degree > 1) return refuse("max_sh_degree", c.sh_degree, "0 or 1");
    if (c.views < 1) return refuse("input_images", c.views, "at least 1");
    if (!std::isfinite(c.znear) || !std::isfinite(c.zfar) || c.znear >= c.zfar)
        return refuse("zfar", static_cast<double>(c.zfar), "a finite number beyond znear");
    if (!(c.fov_degrees >= 0 && c.fov_degrees < 180))
        return refuse("fov", static_cast<double>(c.fov_degrees),
                      "degrees between 0 (focal lengths per view) and 180");
    if (!(c.init_scale.bias > 0))
        return refuse("scale_bias", static_cast<double>(c.init_scale.bias), "more than 0");
    return {};
}

}  // namespace

std::uint32_t PredictorConfig::image_channels() const {
    return 3U + (depth ? 1U : 0U) + (normal ? 3U : 0U) + (mask ? 1U : 0U);
}

std::uint32_t PredictorConfig::input_channels() const {
    return image_channels() + (origin_distance ? 1U : 0U);
}

std::uint32_t PredictorConfig::output_channels() const {
    return 1U + (offset ? 3U : 0U) + 1U + 3U + 4U + (sh_degree == 0 ? 3U : 12U);
}

std::uint32_t PredictorConfig::embedding_length() const {
    switch (embedding) {
        case Embedding::kNone:
            return 0;
        case Embedding::kIndex:  // one scalar, the index of the view
            return embedding_dim;
        default:  // six scalars of the pose, or a vector of that length
            return 6 * embedding_dim;
    }
}

Status check(const PredictorConfig& c) {
    if (c.levels() < 1 || c.levels() > 8)
        return refuse("channel_mult", c.levels(), "1 to 8 levels");
    if (c.num_blocks < 1 || c.num_blocks > 64) return refuse("num_blocks", c.num_blocks, "1 to 64");
    const std::uint32_t stride = 1U << (c.levels() - 1);
    if (c.resolution < stride || c.resolution % stride != 0 || c.resolution > kMaxResolution)
        return error(Code::kInvalidArgument,
                     "configuration: training_resolution is %u, expected a multiple of %u up to %u",
                     c.resolution, stride, kMaxResolution);
    if (c.base_dim < 4) return refuse("base_dim", c.base_dim, "at least 4");
    for (const std::uint32_t mult : c.channel_mult)
        if (mult < 1 || std::uint64_t{mult} * c.base_dim > kMaxChannels)
            return refuse("channel_mult", mult, "at least 1, and no more than 4096 channels");
    if (!(c.dropout >= 0 && c.dropout < 1))
        return refuse("dropout", static_cast<double>(c.dropout), "0 or more, and less than 1");
    if (c.embedding != Embedding::kNone &&
        (c.embedding_dim < 2 || c.embedding_dim % 2 != 0 || c.embedding_dim > 64))
        return refuse("cam_embd.dimension", c.embedding_dim, "an even number up to 64");
    if ((c.token_dim > 0) != (c.tokens > 0))
        return refuse("tokens", c.tokens, "a count where token_dim is given, else 0");
    if (!(c.lora.dropout >= 0 && c.lora.dropout < 1))
        return refuse("lora_dropout", static_cast<double>(c.lora.dropout),
                      "0 or more, and less than 1");
    if (!std::isfinite(c.lora.alpha))
        return refuse("lora_alpha", static_cast<double>(c.lora.alpha), "a finite number");
    return check_geometry(c);
}

}  // namespace splat::model
