#include "prior_models/prior_model.h"

#include <algorithm>
#include <filesystem>

#include "core/os/path.h"

namespace splat::prior_models {
namespace {

/// The model's file, by the preset if none is named. Errors: kNotFound with the way to get it.
Result<std::string> model_path(const Preset& preset, const std::string& given) {
    if (!given.empty()) return given;
    if (preset.file.name.empty())
        return invalid("preset '%s' names no file: give the path of the model",
                       preset.name.c_str());
    const std::string folder = models_folder();
    const std::string path = folder + "/" + preset.file.name;
    std::error_code none;
    if (std::filesystem::is_regular_file(os::path_of(path), none)) return path;
    return not_found(
        "there is no '%s', the model of preset '%s': 'vkrun priors get %s' fetches it where its "
        "address is known, 'vkrun priors where %s' tells about it; or give the path of the model",
        path.c_str(), preset.name.c_str(), preset.name.c_str(), preset.name.c_str());
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

std::string ports_text(const std::vector<NetworkPort>& ports) {
    std::string text;
    for (const NetworkPort& port : ports)
        text += (text.empty() ? "'" : ", '") + port.name + "' " + port_text(port);
    return text.empty() ? "none" : text;
}

}  // namespace

Result<std::unique_ptr<PriorModel>> PriorModel::create(const PriorModelDesc& desc) {
    if (desc.preset.empty() && desc.model.empty())
        return invalid("neither a preset nor a model is named");
    SPLAT_ASSIGN(Preset preset,
                 desc.preset.empty() ? preset_of_file(desc.model) : preset_of(desc.preset));
    SPLAT_ASSIGN(const std::string path, model_path(preset, desc.model));
    SPLAT_ASSIGN(auto runtime, OnnxRuntime::load(desc.runtime));
    auto session = OnnxSession::create(std::move(runtime), path, desc.threads);
    if (!session.ok()) return with_size(session.status(), preset, path);
    std::unique_ptr<PriorModel> model(
        new PriorModel(std::move(preset), std::move(session.value())));
    Status fits = model->check_input();
    if (fits.ok()) fits = model->check_outputs();
    if (!fits.ok()) return with_size(fits, model->preset_, path);
    return model;
}

Status PriorModel::check_input() {
    const PresetInput& input = preset_.input;
    const std::vector<NetworkPort>& ports = session_->inputs();
    const auto refuse = [&](const std::string& expected) {
        return damaged("'%s' has the inputs %s; preset '%s' expects %s", session_->path().c_str(),
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
    const std::vector<NetworkPort>& ports = session_->outputs();
    if (name.empty() && index == -1 && !ports.empty()) return ports.size() - 1;
    for (std::size_t i = 0; i < ports.size(); ++i)
        if (name.empty() ? i == static_cast<std::size_t>(index) : ports[i].name == name) return i;
    return damaged("'%s' has the outputs %s; preset '%s' expects %s", session_->path().c_str(),
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
        session_->path().c_str(), port.name.c_str(), port_text(port).c_str(), preset_.name.c_str(),
        lld(last));
}

Status PriorModel::check_outputs() {
    for (const PresetOutput& output : preset_.outputs) {
        Places& places = places_.emplace_back();
        SPLAT_ASSIGN(places.main, output_place(output.name, output.index));
        if (!output.scale.empty()) SPLAT_SET(places.scale, output_place(output.scale, 0));
        if (!output.mask.empty()) SPLAT_SET(places.mask, output_place(output.mask, 0));
        SPLAT_TRY(check_output(output, session_->outputs()[places.main]));
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
                 session_->run(input, preset_.input.tokens, asked));
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
            const std::string name = "'" + session_->path() + "': output '" +
                                     session_->outputs()[places_[o].main].name + "'";
            SPLAT_ASSIGN(
                maps[output.map],
                finish(output, source, {pictures[i].width, pictures[i].height}, *form, name));
        }
    }
    return {};
}

}  // namespace splat::prior_models
