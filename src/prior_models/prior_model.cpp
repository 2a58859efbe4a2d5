#include "prior_models/prior_model.h"

#include <algorithm>
#include <filesystem>

#include "core/os/path.h"
#include "io/weights_file.h"
#include "prior_models/onnx_session.h"

namespace splat::prior_models {
namespace {

/// The model's file, by the preset if none is named. Errors: kNotFound with the way to get it.
Result<std::string> model_path(const Preset& preset, const std::string& given) {
    if (!given.empty()) return given;
    if (preset.file.name.empty())
        return invalid("preset '%s' names no file: give the path of the model",
                       preset.name.c_str());
    const std::string path = preset_path(preset);
    std::error_code none;
    if (std::filesystem::is_regular_file(os::path_of(path), none)) return path;
    return not_found(
        "there is no '%s', the model of preset '%s': 'vkrun priors get %s' fetches it where its "
        "address is known, 'vkrun priors where %s' tells about it; or give the path of the model",
        path.c_str(), preset.name.c_str(), preset.name.c_str(), preset.name.c_str());
}

/// By ONNX Runtime, or by the caller's function if the file holds weights.
Result<std::unique_ptr<Network>> open_network(const PriorModelDesc& desc, const std::string& path) {
    if (io::is_weights_file(path)) {
        if (desc.open_weights) return desc.open_weights(path);
        return unsupported("'%s' holds weights, expected an ONNX file", path.c_str());
    }
    SPLAT_ASSIGN(auto runtime, OnnxRuntime::load(desc.runtime));
    SPLAT_ASSIGN(auto session, OnnxSession::create(std::move(runtime), path, desc.threads));
    return std::unique_ptr<Network>(std::move(session));
}

/// The preset of a file that alone is given: by its name, or by what its weights are.
Result<Preset> preset_of_model(const std::string& path, const Network* network) {
    if (network != nullptr && !network->preset().empty()) return preset_of(network->preset());
    return preset_of_file(path);
}

/// Refuses the weights of one preset for another. Presets of the caller's own are not looked at.
Status check_preset(const Preset& preset, const Network& network) {
    const std::string made_for = network.preset();
    if (made_for.empty() || preset.file.name.empty()) return {};
    const auto stem = os::text_of(os::path_of(preset.file.name).stem());
    if (stem == made_for) return {};
    return damaged("'%s' has the weights of '%s', expected those of '%s' for preset '%s'",
                   network.path().c_str(), made_for.c_str(), stem.c_str(), preset.name.c_str());
}

/// The error of a model, with a hint if its file is not the preset's.
Status with_size(const Status& refused, const Preset& preset, const std::string& path) {
    std::error_code none;
    const std::uint64_t bytes = std::filesystem::file_size(os::path_of(path), none);
    if (none || refused.code() != Code::kFormat || preset.file.bytes == 0 ||
        bytes == preset.file.bytes)
        return refused;
    return damaged(
        "%s (it has %llu bytes, the preset's file %llu: another model, or fetched in part)",
        refused.message().c_str(), llu(bytes), llu(preset.file.bytes));
}

/// True for one of the names between the bars of `names`.
bool is_one_of(const std::string& name, const std::string& names) {
    return ("|" + names + "|").find("|" + name + "|") != std::string::npos;
}

std::string ports_text(const std::vector<NetworkPort>& ports) {
    std::string text;
    for (const NetworkPort& port : ports)
        text += (text.empty() ? "'" : ", '") + port.name + "' " + port_text(port);
    return text.empty() ? "none" : text;
}

Status set_tokens(Preset& preset, std::uint32_t tokens) {
    if (tokens == 0) return {};
    if (preset.input.tokens == 0)
        return invalid("%u tokens are asked for, but preset '%s' takes none", tokens,
                       preset.name.c_str());
    preset.input.tokens = tokens;
    return {};
}

}  // namespace

Result<std::unique_ptr<PriorModel>> PriorModel::create(const PriorModelDesc& desc) {
    if (desc.preset.empty() && desc.model.empty())
        return invalid("neither a preset nor a model is named");
    const bool by_weights = desc.preset.empty() && io::is_weights_file(desc.model);
    Preset preset;
    if (!by_weights) {
        SPLAT_SET(preset,
                  desc.preset.empty() ? preset_of_file(desc.model) : preset_of(desc.preset));
        SPLAT_TRY(set_tokens(preset, desc.tokens));
    }
    SPLAT_ASSIGN(const std::string path, model_path(preset, desc.model));
    auto network = open_network(desc, path);
    if (!network.ok()) return with_size(network.status(), preset, path);
    if (by_weights) {
        SPLAT_SET(preset, preset_of_model(path, network.value().get()));
        SPLAT_TRY(set_tokens(preset, desc.tokens));
    }
    SPLAT_TRY(check_preset(preset, *network.value()));
    std::unique_ptr<PriorModel> model(
        new PriorModel(std::move(preset), std::move(network.value())));
    Status fits = model->check_input();
    if (fits.ok()) fits = model->check_outputs();
    if (!fits.ok()) return with_size(fits, model->preset_, path);
    return model;
}

Status PriorModel::check_input() {
    const PresetInput& input = preset_.input;
    const std::vector<NetworkPort>& ports = network_->inputs();
    const auto refuse = [&](const std::string& expected) {
        return damaged("'%s' has the inputs %s; preset '%s' expects %s", network_->path().c_str(),
                       ports_text(ports).c_str(), preset_.name.c_str(), expected.c_str());
    };
    const std::size_t count = input.tokens == 0 ? 1 : 2;
    if (ports.size() != count) return refuse(format("%zu", count));
    const bool number = ports[0].type == kOrtFloat || ports[0].type == kOrtHalf;
    const std::vector<std::int64_t>& dims = ports[0].dims;
    const auto fits = [&](std::size_t axis, std::int64_t value) {
        return dims[axis] < 0 || dims[axis] == value;
    };
    const std::size_t channel = input.channels_last ? 3 : 1, row = input.channels_last ? 1 : 2;
    if (!number || dims.size() != 4 || !fits(channel, 3) || dims[0] == 0)
        return refuse(std::string("float32 or float16 of ") +
                      (input.channels_last ? "[n,height,width,3]" : "[n,3,height,width]"));
    if (count == 2 && (ports[1].type != kOrtInt64 || ports[1].dims.size() > 1))
        return refuse("an int64 number of tokens as the second");
    if (dims[0] > 1) return refuse("one picture at a time, or any number");
    batches_ = dims[0] < 0;
    // A model of fixed size is given pictures of that size, whatever the rule for others.
    if (dims[row] > 0 && dims[row + 1] > 0)
        fixed_ = {static_cast<std::uint32_t>(std::min<std::int64_t>(dims[row + 1], UINT32_MAX)),
                  static_cast<std::uint32_t>(std::min<std::int64_t>(dims[row], UINT32_MAX))};
    else if (dims[row] >= 0 || dims[row + 1] >= 0)
        return refuse("two sides, both fixed or both free");
    constexpr std::uint32_t kMost = 16384;
    if (fixed_.width > kMost || fixed_.height > kMost) return refuse("sides of at most 16384");
    if (input.fit != Fit::kStretch) return {};
    const Extent stretched{input.width, input.height};
    if (fixed_ != Extent{} && fixed_ != stretched)
        return refuse(format("%u x %u pixels", input.width, input.height));
    fixed_ = stretched;
    return {};
}

Result<std::size_t> PriorModel::output_place(const std::string& name, std::int32_t index) const {
    const std::vector<NetworkPort>& ports = network_->outputs();
    if (name.empty() && index == -1 && !ports.empty()) return ports.size() - 1;
    for (std::size_t i = 0; i < ports.size(); ++i)
        if (name.empty() ? i == static_cast<std::size_t>(index) : is_one_of(ports[i].name, name))
            return i;
    return damaged("'%s' has the outputs %s; preset '%s' expects %s", network_->path().c_str(),
                   ports_text(ports).c_str(), preset_.name.c_str(),
                   name.empty() ? format("output %d", index).c_str() : ("'" + name + "'").c_str());
}

Status PriorModel::check_output(const PresetOutput& output, const NetworkPort& port) const {
    const bool points = output.map == data::MapKind::kDepth && output.depth == DepthOf::kPoints;
    const std::int64_t last =
        std::int64_t{output.channel} + (points ? 3 : data::channels_of(output.map));
    const std::vector<std::int64_t>& dims = port.dims;
    const bool number = port.type == kOrtFloat || port.type == kOrtHalf;
    const std::int64_t channels =
        dims.size() == 4 ? dims[output.channels_last ? 3 : 1] : std::int64_t{1};
    // Outputs of some graphs have no rank before they run.
    const bool image = dims.empty() ||
                       (dims.size() >= 2 && dims.size() <= 4 && (channels < 0 || channels >= last));
    if (number && image) return {};
    return damaged(
        "'%s': output '%s' is %s; preset '%s' expects float32 or float16 of 2 to 4 "
        "dimensions with %lld or more channels",
        network_->path().c_str(), port.name.c_str(), port_text(port).c_str(), preset_.name.c_str(),
        lld(last));
}

Status PriorModel::check_outputs() {
    for (const PresetOutput& output : preset_.outputs) {
        Places& places = places_.emplace_back();
        SPLAT_ASSIGN(places.main, output_place(output.name, output.index));
        if (!output.scale.empty()) SPLAT_SET(places.scale, output_place(output.scale, 0));
        if (!output.mask.empty()) SPLAT_SET(places.mask, output_place(output.mask, 0));
        SPLAT_TRY(check_output(output, network_->outputs()[places.main]));
    }
    return {};
}

Status PriorModel::check_wanted(const WantedMaps& wanted) const {
    bool any = false;
    for (const data::MapKind kind : data::kMaps) {
        any = any || wanted[kind].has_value();
        if (wanted[kind] && preset_.find(kind) == nullptr)
            return invalid("preset '%s' makes no %s map", preset_.name.c_str(),
                           data::map_name(kind));
    }
    if (any) return {};
    return invalid("no map of a picture is wanted, expected one or more");
}

Result<std::vector<PriorMaps>> PriorModel::run(std::span<const io::Image> pictures,
                                               std::span<const WantedMaps> wanted) const {
    std::vector<Extent> sizes;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        SPLAT_TRY(check_wanted(wanted[i]));
        sizes.push_back(fixed_);
        if (fixed_ != Extent{}) continue;
        SPLAT_ASSIGN(sizes.back(),
                     input_extent(preset_.input, {pictures[i].width, pictures[i].height}));
    }
    std::vector<PriorMaps> all;
    for (std::size_t first = 0; first < pictures.size();) {
        std::size_t end = first + 1;
        while (batches_ && end < pictures.size() && sizes[end] == sizes[first]) ++end;
        SPLAT_TRY(run_batch(pictures.subspan(first, end - first),
                            wanted.subspan(first, end - first), sizes[first], all));
        first = end;
    }
    return all;
}

Status PriorModel::run_batch(std::span<const io::Image> pictures,
                             std::span<const WantedMaps> wanted, Extent size,
                             std::vector<PriorMaps>& all) const {
    NetworkTensor input;
    for (const io::Image& picture : pictures) {
        SPLAT_ASSIGN(NetworkTensor one, prepare(preset_.input, picture, size));
        if (input.dims.empty()) {
            input = std::move(one);
            continue;
        }
        ++input.dims[0];
        input.values.insert(input.values.end(), one.values.begin(), one.values.end());
    }
    std::vector<std::size_t> asked;  // numbers of outputs, each once
    const auto ask = [&asked](std::optional<std::size_t> place) {
        if (place && std::ranges::find(asked, *place) == asked.end()) asked.push_back(*place);
    };
    for (std::size_t o = 0; o < places_.size(); ++o) {
        const data::MapKind kind = preset_.outputs[o].map;
        if (std::ranges::none_of(wanted,
                                 [kind](const WantedMaps& maps) { return maps[kind].has_value(); }))
            continue;
        for (const auto place : {std::optional(places_[o].main), places_[o].scale, places_[o].mask})
            ask(place);
    }
    SPLAT_ASSIGN(const std::vector<NetworkTensor> tensors,
                 network_->run(input, preset_.input.tokens, asked));
    const auto tensor = [&](std::optional<std::size_t> place) -> const NetworkTensor* {
        if (!place) return nullptr;
        return &tensors[static_cast<std::size_t>(std::ranges::find(asked, *place) - asked.begin())];
    };
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        PriorMaps& maps = all.emplace_back();
        for (std::size_t o = 0; o < places_.size(); ++o) {
            const PresetOutput& output = preset_.outputs[o];
            const std::optional<MapForm> form = wanted[i][output.map];
            if (!form) continue;
            const MapSource source{tensor(places_[o].main), tensor(places_[o].scale),
                                   tensor(places_[o].mask), i};
            const std::string name = "'" + network_->path() + "': output '" +
                                     network_->outputs()[places_[o].main].name + "'";
            SPLAT_ASSIGN(
                maps[output.map],
                finish(output, source, {pictures[i].width, pictures[i].height}, *form, name));
        }
    }
    return {};
}

}  // namespace splat::prior_models
