#include "model/config_file.h"

#include "core/config_reader.h"
#include "core/json.h"

namespace splat::model {
namespace {

/// Keys of the sections that describe the network. Of the section data, those that the readers of
/// datasets take are known, too.
const std::vector<std::string> kKnown = {"data.training_resolution",
                                         "data.fov",
                                         "data.znear",
                                         "data.zfar",
                                         "data.input_images",
                                         "data.category",
                                         "data.origin_distances",
                                         "data.use_pred_depth",
                                         "data.use_pred_normal",
                                         "data.use_mask",
                                         "data.custom_embedding",
                                         "data.white_background",
                                         "data.subset",
                                         "data.root",
                                         "data.format",
                                         "data.cache_mib",
                                         "data.name",
                                         "data.split",
                                         "cam_embd.embedding",
                                         "cam_embd.dimension",
                                         "cam_embd.method",
                                         "cam_embd.encode_embedding",
                                         "cam_embd.film",
                                         "model.name",
                                         "model.base_dim",
                                         "model.num_blocks",
                                         "model.channel_mult",
                                         "model.attention_resolutions",
                                         "model.cross_view_attention",
                                         "model.dropout",
                                         "model.max_sh_degree",
                                         "model.isotropic",
                                         "model.network_with_offset",
                                         "model.network_without_offset",
                                         "model.inverted_x",
                                         "model.inverted_y",
                                         "model.depth_scale",
                                         "model.depth_bias",
                                         "model.xyz_scale",
                                         "model.xyz_bias",
                                         "model.opacity_scale",
                                         "model.opacity_bias",
                                         "model.scale_scale",
                                         "model.scale_bias",
                                         "model.token_dim",
                                         "model.tokens",
                                         "model.out_channels"};

bool is_given(const Config& config, const char* key) {
    const ConfigEntry* entry = config.find(key);
    return entry != nullptr && !entry->map &&
           (entry->list || !std::holds_alternative<std::monostate>(entry->values[0]));
}

/// What the published code goes by the category's name for, after the keys that say the same are read. Its
/// merged files have the field of view of the default configuration there, which it never looks at.
Status take_category(const Config& config, PredictorConfig& c) {
    SPLAT_ASSIGN(const std::string category, config.get<std::string>("data.category", ""));
    if (!is_co3d_category(category)) return {};
    if (c.fov_degrees != 0 && c.fov_degrees != PredictorConfig().fov_degrees)
        return error(Code::kInvalidArgument,
                     "%s: 'data.fov' is %g, but 'data.category' is '%s', whose views have focal "
                     "lengths of their own; expected 0, or no data.fov",
                     config.what().c_str(), static_cast<double>(c.fov_degrees), category.c_str());
    if (is_given(config, "data.origin_distances") && !c.origin_distance)
        return error(Code::kInvalidArgument,
                     "%s: 'data.origin_distances' is false, but 'data.category' is '%s', whose "
                     "depths are relative to them; expected true, or no data.origin_distances",
                     config.what().c_str(), category.c_str());
    c.fov_degrees = 0;
    c.origin_distance = true;
    return {};
}

void read_data(ConfigReader& read, PredictorConfig& c) {
    read.count("data.training_resolution", c.resolution);
    read.number("data.fov", c.fov_degrees);
    read.number("data.znear", c.znear);
    read.number("data.zfar", c.zfar);
    read.count("data.input_images", c.views);
    read.flag("data.origin_distances", c.origin_distance);
    read.flag("data.use_pred_depth", c.depth);
    read.flag("data.use_pred_normal", c.normal);
    read.flag("data.use_mask", c.mask);
}

Status refuse(const Config& config, const char* key, const std::string& value,
              const char* expected) {
    return error(Code::kInvalidArgument, "%s: '%s' is %s, expected %s", config.what().c_str(), key,
                 value.c_str(), expected);
}

/// The published code asserts that an embedding enters by FiLM, and has no layer that would take one that
/// is not made of sines and cosines, unless it is the caller's own.
Status check_embedding(const Config& config, const PredictorConfig& c) {
    const auto is_null = [&](const char* key) {
        return config.find(key) != nullptr && !is_given(config, key);
    };
    SPLAT_ASSIGN(const bool custom, config.get<bool>("data.custom_embedding", false));
    if (custom && c.embedding == Embedding::kNone)
        return refuse(config, "cam_embd.embedding", "none",
                      "pose where data.custom_embedding is true, whose vectors take its place");
    if (c.embedding == Embedding::kNone) return {};
    SPLAT_ASSIGN(const std::string method, config.get<std::string>("cam_embd.method", "film"));
    if (method != "film" || is_null("cam_embd.method"))
        return refuse(config, "cam_embd.method", is_null("cam_embd.method") ? "null" : method,
                      "film where there is an embedding");
    if (custom) return {};
    SPLAT_ASSIGN(const std::string encode,
                 config.get<std::string>("cam_embd.encode_embedding", "positional"));
    if (encode != "positional" || is_null("cam_embd.encode_embedding"))
        return refuse(config, "cam_embd.encode_embedding",
                      is_null("cam_embd.encode_embedding") ? "null" : encode,
                      "positional where there is an embedding");
    return {};
}

/// One of the two networks; the published code would build both, or none.
Status read_offset(const Config& config, PredictorConfig& c) {
    constexpr const char* kWith = "model.network_with_offset";
    constexpr const char* kWithout = "model.network_without_offset";
    SPLAT_ASSIGN(const bool without, config.get<bool>(kWithout, false));
    SPLAT_ASSIGN(c.offset, config.get<bool>(kWith, !without));
    if (is_given(config, kWith) && is_given(config, kWithout) && c.offset == without)
        return error(Code::kInvalidArgument, "%s: '%s' and '%s' are both %s, expected one of them",
                     config.what().c_str(), kWith, kWithout, without ? "true" : "false");
    return {};
}

void read_embedding(ConfigReader& read, PredictorConfig& c) {
    const std::string kind = read.choice("cam_embd.embedding", "none", {"none", "pose", "index"});
    bool custom = false;
    read.flag("data.custom_embedding", custom);
    if (kind != "none")
        c.embedding = custom            ? Embedding::kCustom
                      : kind == "index" ? Embedding::kIndex
                                        : Embedding::kPose;
    read.count("cam_embd.dimension", c.embedding_dim);
    if (c.embedding == Embedding::kNone) c.embedding_dim = PredictorConfig().embedding_dim;
    read.choice("cam_embd.method", "film", {"film", "concat"});
    read.choice("cam_embd.encode_embedding", "positional", {"positional", "fourier"});
    c.film = read.choice("cam_embd.film", "reference", {"reference", "affine"}) == "affine"
                 ? Film::kAffine
                 : Film::kReference;
}

void read_network(ConfigReader& read, PredictorConfig& c) {
    read.count("model.base_dim", c.base_dim);
    read.count("model.num_blocks", c.num_blocks);
    read.counts("model.channel_mult", c.channel_mult);
    read.counts("model.attention_resolutions", c.attention_resolutions);
    read.flag("model.cross_view_attention", c.cross_view_attention);
    read.number("model.dropout", c.dropout);
    read.count("model.max_sh_degree", c.sh_degree);
    read.flag("model.isotropic", c.isotropic);
    read.flag("model.inverted_x", c.inverted_x);
    read.flag("model.inverted_y", c.inverted_y);
    read.number("model.depth_scale", c.init_depth.scale);
    read.number("model.depth_bias", c.init_depth.bias);
    read.number("model.xyz_scale", c.init_offset.scale);
    read.number("model.xyz_bias", c.init_offset.bias);
    read.number("model.opacity_scale", c.init_opacity.scale);
    read.number("model.opacity_bias", c.init_opacity.bias);
    read.number("model.scale_scale", c.init_scale.scale);
    read.number("model.scale_bias", c.init_scale.bias);
    read.count("model.token_dim", c.token_dim);
    read.count("model.tokens", c.tokens);
}

Status read_training(ConfigReader& read, const Config& config, PredictorConfig& c) {
    read.texts("opt.freeze", c.frozen);
    bool finetune = false;
    read.flag("opt.lora_finetune", finetune);
    if (!finetune) return {};
    c.lora.rank = 4;  // what the published code always takes
    read.count("opt.lora_rank", c.lora.rank);
    read.number("opt.lora_alpha", c.lora.alpha);
    read.number("opt.lora_dropout", c.lora.dropout);
    read.texts("opt.lora_targets", c.lora.targets);
    read.texts("opt.train_with_adapters", c.lora.trained);
    if (c.lora.rank > 0) return {};
    return error(Code::kInvalidArgument,
                 "%s: 'opt.lora_rank' is 0, expected 1 or more with opt.lora_finetune; to train "
                 "all parameters, set opt.lora_finetune to false",
                 config.what().c_str());
}

}  // namespace

bool is_co3d_category(const std::string& category) {
    return category == "hydrants" || category == "teddybears";
}

Result<PredictorConfig> predictor_config(const Config& config) {
    SPLAT_TRY(config.refuse_unknown(kKnown, {"data", "cam_embd", "model"}));
    PredictorConfig c;
    ConfigReader read(config);
    read_data(read, c);
    read_embedding(read, c);
    read_network(read, c);
    SPLAT_TRY(read_training(read, config, c));
    SPLAT_TRY(read.status());
    SPLAT_TRY(take_category(config, c));
    SPLAT_TRY(check_embedding(config, c));
    SPLAT_TRY(read_offset(config, c));
    SPLAT_TRY(check(c));
    return c;
}

std::string config_text(const PredictorConfig& c) {
    const auto number = [](float value) { return format("%.9g", static_cast<double>(value)); };
    const auto flag = [](bool value) { return std::string(value ? "true" : "false"); };
    const auto texts = [](const std::vector<std::string>& values) {
        std::string text;
        for (const std::string& value : values)
            text += (text.empty() ? "" : ", ") + json_quote(value);
        return "[" + text + "]";
    };
    const auto list = [](const std::vector<std::uint32_t>& values) {
        std::string text;
        for (const std::uint32_t value : values)
            text += (text.empty() ? "" : ", ") + std::to_string(value);
        return "[" + text + "]";
    };
    const bool embeds = c.embedding != Embedding::kNone;
    std::string text =
        "{\"data\": {\"training_resolution\": " + std::to_string(c.resolution) +
        ", \"fov\": " + number(c.fov_degrees) + ", \"znear\": " + number(c.znear) +
        ", \"zfar\": " + number(c.zfar) + ", \"input_images\": " + std::to_string(c.views) +
        ", \"origin_distances\": " + flag(c.origin_distance) +
        ", \"use_pred_depth\": " + flag(c.depth) + ", \"use_pred_normal\": " + flag(c.normal) +
        ", \"use_mask\": " + flag(c.mask) +
        ", \"custom_embedding\": " + flag(c.embedding == Embedding::kCustom) + "},\n";
    text += std::string(" \"cam_embd\": {\"embedding\": \"") +
            (!embeds                            ? "none"
             : c.embedding == Embedding::kIndex ? "index"
                                                : "pose") +
            "\", \"dimension\": " + std::to_string(c.embedding_dim) + ", \"film\": \"" +
            (c.film == Film::kAffine ? "affine" : "reference") + "\"},\n";
    text += " \"model\": {\"base_dim\": " + std::to_string(c.base_dim) +
            ", \"num_blocks\": " + std::to_string(c.num_blocks) +
            ", \"channel_mult\": " + list(c.channel_mult) +
            ", \"attention_resolutions\": " + list(c.attention_resolutions) +
            ", \"cross_view_attention\": " + flag(c.cross_view_attention) +
            ", \"dropout\": " + number(c.dropout) +
            ", \"max_sh_degree\": " + std::to_string(c.sh_degree) +
            ", \"isotropic\": " + flag(c.isotropic) +
            ", \"network_without_offset\": " + flag(!c.offset) +
            ", \"inverted_x\": " + flag(c.inverted_x) + ", \"inverted_y\": " + flag(c.inverted_y) +
            ",\n  \"depth_scale\": " + number(c.init_depth.scale) +
            ", \"depth_bias\": " + number(c.init_depth.bias) +
            ", \"xyz_scale\": " + number(c.init_offset.scale) +
            ", \"xyz_bias\": " + number(c.init_offset.bias) +
            ", \"opacity_scale\": " + number(c.init_opacity.scale) +
            ", \"opacity_bias\": " + number(c.init_opacity.bias) +
            ", \"scale_scale\": " + number(c.init_scale.scale) +
            ", \"scale_bias\": " + number(c.init_scale.bias) +
            ", \"token_dim\": " + std::to_string(c.token_dim) +
            ", \"tokens\": " + std::to_string(c.tokens) + "}";
    if (c.lora.rank == 0 && c.frozen.empty()) return text + "}\n";
    text += ",\n \"opt\": {\"freeze\": " + texts(c.frozen);
    if (c.lora.rank > 0)
        text += ", \"lora_finetune\": true, \"lora_rank\": " + std::to_string(c.lora.rank) +
                ", \"lora_alpha\": " + number(c.lora.alpha) +
                ", \"lora_dropout\": " + number(c.lora.dropout) +
                ", \"lora_targets\": " + texts(c.lora.targets) +
                ", \"train_with_adapters\": " + texts(c.lora.trained);
    return text + "}}\n";
}

}  // namespace splat::model
