#include "predict/published.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include "config/presets.h"
#include "core/os/path.h"
#include "core/shown.h"
#include "core/status.h"
#include "io/network_kind.h"
#include "model/camera_embedding.h"
#include "predict/weights_place.h"

namespace splat::predict {
namespace {

using io::NamedTensor;
using io::NamedTensors;

constexpr const char* kConvEnd = "_conv.weight";

std::string text_of(std::int64_t number) {
    return std::to_string(number);
}

template <class Number>
std::string list_of(const std::vector<Number>& numbers) {
    return "[" + joined(numbers, [](Number number) { return std::to_string(number); }) + "]";
}

std::int64_t dim_of(const NamedTensor* tensor, std::size_t axis) {
    return tensor != nullptr && axis < tensor->dims.size() ? tensor->dims[axis] : 0;
}

/// The network of a file of weights: where its names begin, and its size in pixels.
struct Place {
    std::string network;
    std::int64_t resolution = 0;

    [[nodiscard]] std::string level(const char* side, std::int64_t r) const {
        return network + ".encoder." + side + "." + text_of(r) + "x" + text_of(r) + "_";
    }
};

/// By the first convolution, NETWORK.encoder.enc.RxR_conv.weight.
std::optional<Place> network_place(const NamedTensors& tensors) {
    for (const bool offset : {true, false}) {
        config::ModelConfig config;
        config.offset = offset;
        Place place{config.network_name(), 0};
        const std::string start = place.network + ".encoder.enc.";
        for (const NamedTensor& tensor : tensors) {
            if (!tensor.name.starts_with(start) || !tensor.name.ends_with(kConvEnd)) continue;
            constexpr std::size_t kMostDigits = 6;
            const std::size_t digits =
                std::min(tensor.name.find('x', start.size()), tensor.name.size()) - start.size();
            if (digits == 0 || digits > kMostDigits || tensor.dims.size() != 4) continue;
            const std::string number = tensor.name.substr(start.size(), digits);
            if (number.find_first_not_of("0123456789") != std::string::npos) continue;
            place.resolution = std::stoll(number);
            if (place.resolution < 2) continue;  // a field of view needs two pixels
            if (tensor.name == place.level("enc", place.resolution) + "conv.weight") return place;
        }
    }
    return std::nullopt;
}

/// Width of the ray grid's last pixel from the middle, at depth 1: what its field of view depends on.
std::optional<double> last_ray(const NamedTensors& tensors, std::size_t r) {
    const NamedTensor* const rays = tensors.find("ray_dirs");
    if (rays == nullptr || rays->values.size() != 3 * r * r || !tensors.unchanged().ok())
        return std::nullopt;
    return std::abs(static_cast<double>(rays->values[r - 1]));
}

/// A field of view as data.fov has it.
std::string fov_text(double ray, double resolution) {
    if (std::abs(ray - (resolution - 1) / 2) < 0.25) return "0, each view its own";
    const double tangent = ray * resolution / (resolution - 1);
    return format("%.4g degrees", 2 * std::atan(tangent) * 180 / std::numbers::pi);
}

struct Known {
    std::string name, category;
    Traits traits;
    double ray = 0;  ///< the value that last_ray() gives for its weights
    std::uint32_t resolution = 0;
    std::string head;
};

/// The published networks: second stages of trainings change nothing here and are left out, as is "small", which is
/// for a first training.
std::vector<Known> read_known_networks() {
    std::vector<Known> known;
    for (const config::Preset& preset : config::presets()) {
        const std::string name(preset.name);
        if (name == "small") continue;
        const auto settings = settings_of(std::string(preset.text), name);
        if (!settings.ok()) continue;  // tests/config reads all of them
        const config::ModelConfig& network = settings.value().network;
        Known one{name,
                  settings.value().training.category,
                  traits_of(network),
                  0,
                  network.resolution,
                  network.head_name};
        one.ray = std::abs(
            static_cast<double>(model::pixel_rays(network)[network.output_resolution() - 1]));
        const bool second = std::ranges::any_of(known, [&one](const Known& other) {
            return other.category == one.category && other.traits == one.traits;
        });
        if (!second) known.push_back(std::move(one));
    }
    return known;
}

const std::vector<Known>& known_networks() {
    static const std::vector<Known> all = read_known_networks();
    return all;
}

bool of_one_network(const Traits& a, const Traits& b) {
    return a.front().first == b.front().first;
}

/// One network by its traits.
std::vector<std::string> differences_of(const Traits& file, const Known& known) {
    std::vector<std::string> differences;
    for (std::size_t i = 0; i < file.size(); ++i)
        if (file[i].second != known.traits[i].second)
            differences.push_back(file[i].first + " is " + file[i].second + " (there " +
                                  known.traits[i].second + ")");
    return differences;
}

bool is_official_name(const std::string& path, const std::string& name) {
    const std::string stem = os::text_of(os::path_of(path).stem());
    return stem == "model_" + name || (stem == "model_latest" && name == "objaverse");
}

constexpr const char* kLgmFirst = "unet.conv_in.weight";

Traits lgm_traits(const std::array<std::vector<std::int64_t>, 4>& levels, std::int64_t in,
                  std::int64_t out) {
    return {{"model.down", list_of(levels[0])},
            {"model.down_attention", list_of(levels[1])},
            {"model.up", list_of(levels[2])},
            {"model.up_attention", list_of(levels[3])},
            {"the count of input channels", text_of(in)},
            {"the count of output channels", text_of(out)}};
}

/// Traits of tensors under the names of LGM's network.
Traits lgm_traits(const NamedTensors& tensors) {
    std::array<std::vector<std::int64_t>, 4> levels;
    for (const std::size_t way : {0U, 1U})
        for (std::int64_t level = 0;; ++level) {
            const std::string block =
                (way == 0 ? "unet.down_blocks." : "unet.up_blocks.") + text_of(level);
            const NamedTensor* const bias = tensors.find(block + ".nets.0.conv1.bias");
            if (bias == nullptr) break;
            levels[2 * way].push_back(dim_of(bias, 0));
            levels[2 * way + 1].push_back(
                tensors.find(block + ".attns.0.attn.qkv.weight") == nullptr ? 0 : 1);
        }
    return lgm_traits(levels, dim_of(tensors.find(kLgmFirst), 1),
                      dim_of(tensors.find("conv.weight"), 0));
}

}  // namespace

Traits traits_of(const NamedTensors& tensors) {
    if (tensors.find(kLgmFirst) != nullptr) return lgm_traits(tensors);
    const std::optional<Place> found = network_place(tensors);
    if (!found) return {};
    const Place& place = *found;
    const auto tensor = [&](const std::string& name) { return tensors.find(name); };
    const std::string first = place.level("enc", place.resolution);
    const std::int64_t base = dim_of(tensor(first + "conv.weight"), 0);
    std::int64_t blocks = 0;
    while (tensor(first + "block" + text_of(blocks) + ".norm0.weight") != nullptr) ++blocks;
    std::vector<std::int64_t> widths, attention;
    std::int64_t lowest = place.resolution;
    for (std::int64_t r = place.resolution; r > 0 && base > 0; r /= 2) {
        const std::string level = place.level("enc", r);
        const NamedTensor* const last =
            tensor(level + "block" + text_of(blocks - 1) + ".conv1.bias");
        if (last == nullptr) break;
        widths.push_back(dim_of(last, 0) / base);
        if (tensor(level + "block0.qkv.weight") != nullptr) attention.push_back(r);
        lowest = r;
    }
    const std::int64_t affine = dim_of(tensor(first + "block0.affine.weight"), 0);
    const std::int64_t block = dim_of(tensor(first + "block0.conv1.bias"), 0);
    const auto adapter = std::ranges::find_if(
        tensors, [](const NamedTensor& one) { return one.name.ends_with(".lora_A"); });
    return {
        {"model.network_with_offset", place.network == "network_with_offset" ? "true" : "false"},
        {"data.training_resolution", text_of(place.resolution)},
        {"model.base_dim", text_of(base)},
        {"model.num_blocks", text_of(blocks)},
        {"model.channel_mult", list_of(widths)},
        {"model.attention_resolutions", list_of(attention)},
        {"the count of input channels", text_of(dim_of(tensor(first + "conv.weight"), 1))},
        {"the count of output channels", text_of(dim_of(tensor(place.network + ".out.weight"), 0))},
        {"the length of embeddings",
         text_of(dim_of(tensor(place.network + ".encoder.map_layer0.weight"), 1))},
        {"cam_embd.film", affine == 0       ? "none"
                          : affine == block ? "reference"
                                            : "affine"},
        {"model.token_dim",
         text_of(
             dim_of(tensor(place.level("dec", lowest) + "in0.cross_attention.k_proj.weight"), 1))},
        {"opt.lora_rank", text_of(adapter == tensors.end() ? 0 : dim_of(&*adapter, 0))}};
}

Traits traits_of(const config::ModelConfig& c) {
    if (c.network == config::Network::kLgmUnet) {
        const auto wide = [](const std::vector<std::uint32_t>& from) {
            return std::vector<std::int64_t>(from.begin(), from.end());
        };
        return lgm_traits({wide(c.lgm.down), wide(c.lgm.down_attention), wide(c.lgm.up),
                           wide(c.lgm.up_attention)},
                          c.image_channels(), c.output_channels());
    }
    std::vector<std::uint32_t> attention;
    for (std::uint32_t level = 0; level < c.levels(); ++level) {
        const std::uint32_t r = c.names_resolution() >> level;
        const auto& all = c.attention_resolutions;
        if (std::ranges::find(all, r) != all.end()) attention.push_back(r);
    }
    const bool embedded = c.embedding != config::Embedding::kNone;
    const char* const film = c.film == config::Film::kReference ? "reference" : "affine";
    return {{"model.network_with_offset", c.offset ? "true" : "false"},
            {"data.training_resolution", text_of(c.names_resolution())},
            {"model.base_dim", text_of(c.base_dim)},
            {"model.num_blocks", text_of(c.num_blocks)},
            {"model.channel_mult", list_of(c.channel_mult)},
            {"model.attention_resolutions", list_of(attention)},
            {"the count of input channels", text_of(c.image_channels())},
            {"the count of output channels", text_of(c.output_channels())},
            {"the length of embeddings", text_of(c.embedding_length())},
            {"cam_embd.film", embedded ? film : "none"},
            {"model.token_dim", text_of(c.token_dim)},
            {"opt.lora_rank", text_of(c.lora.rank)}};
}

PublishedFit published_fit(const NamedTensors& tensors, const std::string& path) {
    PublishedFit fit;
    const Traits file = traits_of(tensors);
    if (file.empty()) {
        fit.look = io::network_text(tensors);
        return fit;
    }
    for (const Known& known : known_networks()) {
        if (!of_one_network(file, known.traits)) continue;
        const std::optional<double> ray = last_ray(tensors, known.resolution);
        std::vector<std::string> differences = differences_of(file, known);
        // The published fields of view differ by 6 %; rounding to bfloat16 changes 0.4 %.
        if (ray && std::abs(*ray - known.ray) > 0.01 * known.ray &&
            file[1].second == known.traits[1].second)
            differences.push_back("the field of view of ray_dirs is " +
                                  fov_text(*ray, known.resolution) + " (there " +
                                  fov_text(known.ray, known.resolution) + ")");
        if (differences.empty()) {
            if (fit.names.empty()) fit.head = known.head;
            fit.names.push_back(known.name);
        } else if (fit.nearest.empty() || differences.size() < fit.differences.size()) {
            fit.nearest = known.name;
            fit.differences = std::move(differences);
        }
    }
    if (fit.names.empty()) return fit;
    fit.nearest.clear();
    fit.differences.clear();
    for (const std::string& name : std::vector(fit.names))
        if (fit.names.size() > 1 && is_official_name(path, name)) fit.names = {name};
    return fit;
}

std::string PublishedFit::sentence() const {
    if (names.size() == 1) return "its tensors fit the published configuration " + names[0];
    if (!names.empty()) return "its tensors fit the published configurations " + joined(names);
    if (nearest.empty())
        return "its tensors fit no published configuration: none is "
               "'network_with_offset.encoder.enc.RxR_conv.weight' or 'unet.conv_in.weight', and "
               "they look like " +
               look;
    return "its tensors fit no published configuration; the nearest is " + nearest + ", but " +
           joined(differences);
}

Status expect_network(const NamedTensors& tensors, const config::ModelConfig& config) {
    const Traits file = traits_of(tensors), own = traits_of(config);
    const bool alike = !file.empty() && of_one_network(file, own);
    const std::optional<Place> place = network_place(tensors);
    if (alike && file == own) return {};
    // LGM must agree in every level and channel. Grafting widens a SongUNet, not its head.
    if (alike && place &&
        dim_of(tensors.find(place->network + ".out.weight"), 0) == config.output_channels())
        return {};
    const PublishedFit fit = published_fit(tensors, "");
    std::string sentence = fit.sentence();
    if (alike && place) {
        if (fit.names.empty() || fit.head == config.head_name) return {};
        sentence +=
            ", whose head is '" + fit.head + "', but 'model.head' is '" + config.head_name + "'";
    }
    return invalid("the weights are of another network than the configuration's: %s",
                   sentence.c_str());
}

void PublishedFit::write(JsonWriter& json) const {
    json.begin_object().key("fit").list(names).member("head", head).member("nearest", nearest);
    json.key("differences").list(differences).member("sentence", sentence()).end();
}

}  // namespace splat::predict
