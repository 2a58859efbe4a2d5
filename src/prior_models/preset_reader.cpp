#include "prior_models/preset_reader.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>

#include "core/config.h"
#include "core/path_name.h"
#include "core/shown.h"

namespace splat::prior_models {
namespace {

constexpr double kMostInputSide = 16384;

/// The members of one object of a preset. The first error stays, so that readers need not stop.
class Members {
  public:
    Members(const JsonTree* tree, std::string place, std::vector<std::string> known)
        : tree_(tree), place_(std::move(place)) {
        const auto* const object =
            tree == nullptr ? nullptr : std::get_if<JsonTree::Object>(&tree->value);
        if (object == nullptr) {
            refuse("is missing, or no object");
            tree_ = nullptr;
            return;
        }
        for (const auto& member : *object)
            if (std::ranges::find(known, member.name) == known.end()) {
                const std::string nearest = nearest_name(member.name, known);
                refuse("has an unknown member '" + member.name + "'" +
                       (nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
            }
    }

    [[nodiscard]] bool has(const char* name) const { return find(name) != nullptr; }
    [[nodiscard]] const JsonTree* find(const char* name) const {
        return tree_ == nullptr ? nullptr : tree_->find(name);
    }
    [[nodiscard]] std::string place(const char* name) const { return place_ + "." + name; }
    [[nodiscard]] const Status& status() const { return status_; }

    void refuse(const std::string& sentence) {
        if (status_.ok()) status_ = Status(Code::kInvalidArgument, place_ + " " + sentence);
    }
    void take(const Status& other) {
        if (status_.ok()) status_ = other;
    }

    void text(const char* name, std::string& to, bool required = false) {
        const JsonTree* const found = find(name);
        if (found == nullptr && !required) return;
        const std::string* const value = found == nullptr ? nullptr : found->text();
        if (value == nullptr || (required && value->empty()))
            return refuse(std::string("needs a text '") + name + "'");
        to = *value;
    }

    template <class T>
    void number(const char* name, double least, double most, T& to, bool whole = true) {
        const JsonTree* const found = find(name);
        if (found == nullptr) return;
        const auto value = found->number();
        if (!value || !(*value >= least && *value <= most) ||
            (whole && std::floor(*value) != *value))
            return refuse(format("needs a %snumber '%s' from %g to %g", whole ? "whole " : "", name,
                                 least, most));
        to = static_cast<T>(*value);
    }

    void flag(const char* name, bool& to) {
        const JsonTree* const found = find(name);
        if (found == nullptr) return;
        const bool* const value = std::get_if<bool>(&found->value);
        if (value == nullptr) return refuse(std::string("needs true or false for '") + name + "'");
        to = *value;
    }

    /// The place of a word in a list; the first word if it is missing.
    template <std::size_t N>
    std::size_t word(const char* name, const char* const (&words)[N], bool required = false) {
        std::string value = required ? "" : words[0];
        text(name, value, required);
        const auto* const found = std::ranges::find(words, value);
        if (found != std::end(words)) return static_cast<std::size_t>(found - std::begin(words));
        refuse(std::string("has the ") + name + " '" + shown(value) + "', expected one of " +
               joined(words));
        return 0;
    }

    template <class T, std::size_t N>
    void numbers(const char* name, std::array<T, N>& to) {
        const JsonTree* const found = find(name);
        if (found == nullptr) return;
        const JsonTree::List* const list = found->list();
        if (list == nullptr || list->size() != N)
            return refuse(format("needs a list '%s' of %zu numbers", name, N));
        for (std::size_t i = 0; i < N; ++i) {
            const auto value = (*list)[i].number();
            if (!value || !std::isfinite(*value))
                return refuse(format("needs a list '%s' of %zu numbers", name, N));
            to[i] = static_cast<T>(*value);
        }
    }

    void filter(const char* name, data::ValueFilter& to) {
        std::string value;
        text(name, value, true);
        const auto found = data::value_filter_of(value);
        if (found) to = *found;
        if (!found)
            refuse(std::string("has the ") + name + " '" + shown(value) + "', expected one of " +
                   data::value_filter_names());
    }

  private:
    const JsonTree* tree_;
    std::string place_;
    Status status_;
};

constexpr const char* kLayouts[] = {"NCHW", "NHWC"};

PresetInput read_input(Members& of) {
    constexpr const char* kFits[] = {"stretch", "minimal", "upper_bound", "lower_bound", "own"};
    Members in(of.find("input"), of.place("input"),
               {"layout", "fit", "size", "multiple", "filter", "scale", "mean", "std", "tokens"});
    PresetInput input;
    input.channels_last = in.word("layout", kLayouts) == 1;
    input.fit = static_cast<Fit>(in.word("fit", kFits));
    std::array<double, 2> size{};
    in.numbers("size", size);
    if (input.fit == Fit::kOwn && in.has("size")) in.refuse("has a 'size', but its fit is 'own'");
    for (const double side : size)
        if (input.fit != Fit::kOwn &&
            !(side >= 1 && side <= kMostInputSide && std::floor(side) == side))
            in.refuse(format("needs a 'size' of two whole numbers from 1 to %g", kMostInputSide));
    input.width = static_cast<std::uint32_t>(std::clamp(size[0], 0.0, kMostInputSide));
    input.height = static_cast<std::uint32_t>(std::clamp(size[1], 0.0, kMostInputSide));
    in.number("multiple", 1, 1024, input.multiple);
    in.filter("filter", input.filter);
    const JsonTree* const scale = in.find("scale");
    input.by_maximum = scale != nullptr && scale->text() != nullptr && *scale->text() == "maximum";
    if (!input.by_maximum) in.number("scale", 1e-6, 1e6, input.scale, false);
    in.numbers("mean", input.mean);
    in.numbers("std", input.std);
    for (const double deviation : input.std)
        if (!(deviation > 0)) in.refuse("needs numbers above 0 in 'std'");
    in.number("tokens", 1, 1e6, input.tokens);
    of.take(in.status());
    return input;
}

PresetOutput read_output(const JsonTree& tree, const std::string& place, Members& of) {
    constexpr const char* kMapNames[] = {"depth", "normal", "mask"};
    constexpr const char* kDepths[] = {"inverse", "distance", "points"};
    Members in(&tree, place,
               {"map", "name", "index", "layout", "channel", "sigmoid", "min_max", "depth", "signs",
                "filter", "bytes_first", "threshold", "scale", "mask"});
    PresetOutput output;
    static_assert(data::kMaps[0] == data::MapKind::kDepth &&
                  data::kMaps[1] == data::MapKind::kNormal &&
                  data::kMaps[2] == data::MapKind::kMask);
    output.map = data::kMaps[in.word("map", kMapNames, true)];
    in.text("name", output.name);
    in.number("index", -1, 1000, output.index);
    output.channels_last = in.word("layout", kLayouts) == 1;
    in.number("channel", 0, 1000, output.channel);
    in.flag("sigmoid", output.sigmoid);
    in.flag("min_max", output.min_max);
    output.depth = static_cast<DepthOf>(in.word("depth", kDepths));
    in.numbers("signs", output.signs);
    for (const float sign : output.signs)
        if (sign != 1 && sign != -1) in.refuse("needs 1 or -1 in 'signs'");
    in.filter("filter", output.filter);
    in.flag("bytes_first", output.bytes_first);
    if (in.has("threshold")) in.number("threshold", 0, 255, output.threshold.emplace());
    in.text("scale", output.scale);
    in.text("mask", output.mask);
    const auto only = [&in](bool allowed, const char* kind, std::vector<const char*> names) {
        for (const char* const name : names)
            if (!allowed && in.has(name))
                in.refuse(std::string("has '") + name + "', which goes with " + kind);
    };
    const bool mask = output.map == data::MapKind::kMask,
               depth = output.map == data::MapKind::kDepth;
    only(mask, "a mask", {"sigmoid", "min_max", "bytes_first", "threshold"});
    only(depth, "depth", {"depth"});
    only(output.map == data::MapKind::kNormal, "normals", {"signs"});
    only(depth && output.depth == DepthOf::kPoints, "a depth of points", {"scale", "mask"});
    of.take(in.status());
    return output;
}

}  // namespace

Result<Preset> read_preset(const JsonTree& tree) {
    Preset preset;
    Members of(&tree, "the preset",
               {"name", "title", "input", "outputs", "file", "licence", "note"});
    of.text("name", preset.name, true);
    of.text("title", preset.title);
    of.text("licence", preset.licence);
    of.text("note", preset.note);
    preset.input = read_input(of);
    const JsonTree::List* const outputs = tree["outputs"].list();
    if (outputs == nullptr || outputs->empty()) of.refuse("needs a list 'outputs' of one or more");
    for (std::size_t i = 0; outputs != nullptr && i < outputs->size() && of.status().ok(); ++i) {
        const std::string place = format("the preset.outputs[%zu]", i);
        PresetOutput output = read_output((*outputs)[i], place, of);
        if (preset.find(output.map) != nullptr)
            of.take(invalid("%s is a second %s map", place.c_str(), data::map_name(output.map)));
        preset.outputs.push_back(std::move(output));
    }
    if (of.has("file")) {
        Members file(of.find("file"), of.place("file"), {"name", "url", "bytes", "sha256"});
        file.text("name", preset.file.name);
        file.text("url", preset.file.url);
        file.number("bytes", 1, 1e15, preset.file.bytes);
        file.text("sha256", preset.file.sha256);
        of.take(file.status());
        if (!preset.file.name.empty() && !is_name_in_folder(preset.file.name))
            of.take(invalid("%s.name is '%s', expected the name of a file in the folder of models",
                            of.place("file").c_str(), shown(preset.file.name).c_str()));
        std::string& hash = preset.file.sha256;
        for (char& digit : hash)
            digit = static_cast<char>(std::tolower(static_cast<unsigned char>(digit)));
        const bool digits = hash.find_first_not_of("0123456789abcdef") == std::string::npos;
        if (!hash.empty() && (hash.size() != 64 || !digits))
            of.take(invalid("%s.sha256 is '%s', expected 64 hexadecimal digits",
                            of.place("file").c_str(), shown(hash).c_str()));
    }
    const Status& status = of.status();
    if (status.ok()) return preset;
    const std::string whose = preset.name.empty() ? "" : "preset '" + preset.name + "': ";
    return Status(status.code(), whose + status.message());
}

}  // namespace splat::prior_models
