#include "fit/fit_options.h"

#include <cmath>

#include "core/json_tree.h"
#include "core/json_writer.h"
#include "core/number_in.h"
#include "fit/schedule.h"

namespace splat::fit {
namespace {

constexpr double kDefaultSeconds = 60;
constexpr std::uint64_t kMostSeed = std::uint64_t{1} << 53;  ///< JSON holds it exactly

/// Call `visit(name, value of the options, given value)` for each option; without a given value for those that only
/// FitDesc::values sets.
template <class Options, class Given, class Visit>
void each_option(Options& options, Given& given, const Visit& visit) {
    visit("data", options.data, given.data);
    visit("cameras", options.cameras, given.cameras);
    visit("masks", options.masks, given.masks);
    visit("white_background", options.white_background, given.white_background);
    visit("downscale", options.downscale, given.downscale);
    visit("test_every", options.test_every, given.test_every);
    visit("steps", options.steps, given.steps);
    visit("seconds", options.seconds, given.seconds);
    visit("max_gaussians", options.max_gaussians, given.max_gaussians);
    visit("sh_degree", options.sh_degree, given.sh_degree);
    visit("seed", options.seed, given.seed);
    visit("depth", options.depth, given.depth);
    visit("normals", options.normals, given.normals);
    visit("init", options.init, given.init);
    visit("depth_is_distance", options.depth_is_distance, std::optional<bool>());
    visit("depth_weight", options.depth_weight, std::optional<double>());
    visit("normal_weight", options.normal_weight, std::optional<double>());
    visit("memory", options.memory, given.memory);
    const std::optional<std::uint64_t> by_value;
    visit("memory_gaussians", options.memory_gaussians, by_value);
    visit("memory_downscale", options.memory_downscale, by_value);
    visit("refine_poses", options.refine_poses, given.refine_poses);
    visit("refine_exposure", options.refine_exposure, given.refine_exposure);
    const auto by_name = [&](const char* name, auto& value) {
        visit(name, value, std::optional<std::remove_cvref_t<decltype(value)>>());
    };
    by_name("strategy", options.strategy);
    by_name("mcmc_noise", options.tuning.mcmc_noise);
    by_name("opacity_weight", options.tuning.opacity_weight);
    by_name("scale_weight", options.tuning.scale_weight);
    by_name("growth_every", options.tuning.growth_every);
    by_name("rate", options.tuning.rate);
    by_name("skip_sizes", options.tuning.skip_sizes);
    by_name("skip_bands", options.tuning.skip_bands);
    by_name("skip_unseen", options.tuning.skip_unseen);
    by_name("skip_tiles", options.tuning.skip_tiles);
}

std::string text_of(const std::string& value) {
    return '"' + value + '"';
}
std::string text_of(bool value) {
    return value ? "true" : "false";
}
std::string text_of(double value) {
    return format("%g", value);
}
std::string text_of(std::uint64_t value) {
    return std::to_string(value);
}

bool parse(const std::string& text, std::string& value) {
    value = text;
    return true;
}
bool parse(const std::string& text, bool& value) {
    value = text == "true";
    return value || text == "false";
}
template <class Number>
bool parse(const std::string& text, Number& value) {
    const std::optional<Number> number = number_in<Number>(text);
    if (number) value = *number;
    return number.has_value();
}

/// Call `visit(name, value of the options, wanted value)` for each option, wanted by its own member of `given` or by
/// given.values.
template <class Visit>
Status each_wanted(FitOptions& options, const FitDesc& given, const Visit& visit) {
    std::vector<bool> known(given.values.size());
    Status status;
    std::string names;
    each_option(options, given, [&](const char* name, auto& value, const auto& own) {
        auto wanted = own;
        names += std::string(names.empty() ? "" : ", ") + name;
        for (std::size_t i = 0; i < given.values.size(); ++i) {
            const std::string& text = given.values[i];
            const std::size_t at = text.find('=');
            if (at == std::string::npos || text.compare(0, at, name) != 0) continue;
            known[i] = true;
            auto parsed = value;
            if (wanted)
                status = invalid("%s is given twice, expected once", name);
            else if (!parse(text.substr(at + 1), parsed))
                status = invalid("%s is no value of %s, whose default is %s",
                                 text.substr(at + 1).c_str(), name, text_of(value).c_str());
            else
                wanted = parsed;
        }
        visit(name, value, wanted);
    });
    for (std::size_t i = 0; i < known.size() && status.ok(); ++i)
        if (!known[i])
            status = invalid("'%s' sets no option of a fit, expected NAME=VALUE with one of %s",
                             given.values[i].c_str(), names.c_str());
    return status;
}

bool take(const JsonTree& json, std::string& value) {
    if (json.text() != nullptr) value = *json.text();
    return json.text() != nullptr;
}
bool take(const JsonTree& json, std::uint64_t& value) {
    value = json.count().value_or(0);
    return json.count().has_value();
}
bool take(const JsonTree& json, double& value) {
    value = json.number().value_or(0);
    return json.number().has_value();
}
bool take(const JsonTree& json, bool& value) {
    const bool* const found = std::get_if<bool>(&json.value);
    value = found != nullptr && *found;
    return found != nullptr;
}

Status in_range(const char* name, std::uint64_t value, std::uint64_t least, std::uint64_t most) {
    if (value >= least && value <= most) return {};
    return invalid("%s is %llu, expected %llu to %llu", name, llu(value), llu(least), llu(most));
}

Status check_strategy(const FitOptions& o) {
    const Strategy& s = o.tuning;
    if (o.strategy != "split" && o.strategy != "mcmc")
        return invalid("strategy is '%s', expected split or mcmc", o.strategy.c_str());
    for (const auto& [name, value] :
         {std::pair("mcmc_noise", s.mcmc_noise), std::pair("opacity_weight", s.opacity_weight),
          std::pair("scale_weight", s.scale_weight), std::pair("rate", s.rate)})
        if (!std::isfinite(value) || value < 0)
            return invalid("%s is %g, expected a number of 0 or more", name, value);
    if (o.strategy == "mcmc" && s.skip_unseen)
        return invalid(
            "skip_unseen is true, but the regularisers of mcmc move unseen Gaussians, too: "
            "expected false, or the strategy split");
    return in_range("growth_every", s.growth_every, 0, kMostSteps);
}

Status check(const FitOptions& o) {
    if (o.data.empty()) return invalid("no data, expected a folder of photographs");
    if (o.cameras != "auto" && o.cameras != "colmap" && o.cameras != "transforms")
        return invalid("cameras is '%s', expected auto, colmap or transforms", o.cameras.c_str());
    if (o.init == "depth" && o.depth.empty())
        return invalid("init is depth, expected a folder of depth maps, too");
    for (const auto& [name, weight] :
         {std::pair("depth_weight", o.depth_weight), std::pair("normal_weight", o.normal_weight)})
        if (!(std::isfinite(weight) && weight >= 0))
            return invalid("%s is %g, expected a number from 0", name, weight);
    SPLAT_TRY(in_range("downscale", o.downscale, 1, 64));
    SPLAT_TRY(in_range("test_every", o.test_every, 0, UINT32_MAX));
    SPLAT_TRY(in_range("steps", o.steps, 0, kMostSteps));
    SPLAT_TRY(in_range("sh_degree", o.sh_degree, 0, scene::kMaxShDegree));
    SPLAT_TRY(in_range("seed", o.seed, 0, kMostSeed));
    SPLAT_TRY(in_range("memory", o.memory, 0, UINT64_MAX >> 1));
    if (o.memory_gaussians != 0)
        SPLAT_TRY(in_range("memory_gaussians", o.memory_gaussians, 2, UINT32_MAX));
    SPLAT_TRY(in_range("memory_downscale", o.memory_downscale, 0, 64));
    if (o.max_gaussians != 0) SPLAT_TRY(in_range("max_gaussians", o.max_gaussians, 2, UINT32_MAX));
    if (!std::isfinite(o.seconds) || o.seconds < 0)
        return invalid("seconds is %g, expected a number above 0", o.seconds);
    return check_strategy(o);
}

/// Refuse an option of that name which is given to a fit in which it changes nothing.
Status check_effect(const FitOptions& o, const char* name) {
    const auto is = [name](auto... names) { return ((std::string_view(name) == names) || ...); };
    const char* lacks = nullptr;
    if (is("depth_weight", "depth_is_distance") && o.depth.empty()) lacks = "depth maps";
    if (is("normal_weight") && o.normals.empty()) lacks = "maps of normals";
    if (is("mcmc_noise", "opacity_weight", "scale_weight") && o.strategy != "mcmc")
        lacks = "the strategy mcmc";
    if (lacks == nullptr) return {};
    return invalid("%s is given, but changes nothing without %s", name, lacks);
}

}  // namespace

Result<FitOptions> options_of(const FitDesc& given) {
    FitOptions options;
    std::vector<const char*> names;
    SPLAT_TRY(each_wanted(options, given, [&](const char* name, auto& value, const auto& wanted) {
        if (!wanted) return;
        value = *wanted;
        names.push_back(name);
    }));
    SPLAT_TRY(check(options));
    for (const char* const name : names) SPLAT_TRY(check_effect(options, name));
    if (options.steps != 0 && options.seconds > 0)
        return invalid("seconds is %g and steps %llu, expected one of them", options.seconds,
                       llu(options.steps));
    if (options.steps == 0 && options.seconds == 0) options.seconds = kDefaultSeconds;
    return options;
}

Result<FitOptions> options_of_run(const run::ReadText& config, const FitDesc& given) {
    SPLAT_ASSIGN(const JsonTree json, parse_json_tree(config.text, config.path.c_str()));
    FitOptions options;
    std::string lacks, differs;
    SPLAT_TRY(each_wanted(options, given, [&](const char* name, auto& value, const auto& wanted) {
        if (!take(json[name], value) && lacks.empty()) lacks = name;
        if (!wanted || *wanted == value) return;
        if (std::string_view(name) == "memory")  // the steps depend on what it was cut to
            value = *wanted;
        else if (differs.empty())
            differs = name;
    }));
    if (!lacks.empty() || options.steps == 0)
        return damaged("'%s' has no '%s': the run is no fit", config.path.c_str(),
                       lacks.empty() ? "steps" : lacks.c_str());
    if (!differs.empty())
        return invalid(
            "%s differs from that of the run, on which its steps depend: leave it out to resume, "
            "or begin a "
            "new run",
            differs.c_str());
    const Status checked = check(options);
    if (!checked.ok()) return damaged("'%s': %s", config.path.c_str(), checked.message().c_str());
    return options;
}

std::string config_text(const FitOptions& options) {
    JsonWriter json;
    json.begin_object();
    const FitDesc none;
    each_option(options, none, [&](const char* name, const auto& value, const auto&) {
        json.newline(2).member(name, value);
    });
    json.newline().end();
    return json.text() + "\n";
}

Strategy strategy_of(const FitOptions& options) {
    Strategy strategy = options.tuning;
    strategy.mcmc = options.strategy == "mcmc";
    return strategy;
}

data::PosedPhotosOptions photos_of(const FitOptions& options) {
    using Cameras = data::PosedPhotosOptions::Cameras;
    data::PosedPhotosOptions photos;
    photos.cameras = options.cameras == "colmap"       ? Cameras::kColmap
                     : options.cameras == "transforms" ? Cameras::kTransforms
                                                       : Cameras::kAuto;
    photos.downscale = static_cast<std::uint32_t>(options.downscale);
    photos.test_every = static_cast<std::uint32_t>(options.test_every);
    photos.masks = options.masks;
    photos.white_background = options.white_background;
    photos.depth = options.depth;
    photos.normals = options.normals;
    photos.depth_is_distance = options.depth_is_distance;
    return photos;
}

}  // namespace splat::fit
