#pragma once

#include "config/heads.h"
#include "config/key_rows.h"

namespace splat::config::rows {

inline constexpr Condition kBoxed{[](const Settings& s) { return s.network.positions == kHeadBox; },
                                  "unless model.head.positions is box"};
inline constexpr Condition kDepths{
    [](const Settings& s) { return s.network.positions == kHeadInputDepth; },
    "unless model.head.positions is input_depth"};

inline constexpr Condition kRayDepths{
    [](const Settings& s) { return s.network.positions == kHeadRayDepth; },
    "unless model.head.positions is ray_depth"};
inline constexpr Condition kOnRays{
    [](const Settings& s) { return s.network.positions != kHeadBox; },
    "where model.head.positions is box"};

/// A word for each value of a member, from `First` on.
template <auto Member, int First>
constexpr Field kWord{KeyType::kChoice, Part::kNetwork,
                      [](const Config& config, const Key& key, Settings& settings) {
                          auto& member = settings.network.*Member;
                          int place = static_cast<int>(member) - First;
                          Status status = read_word(config, key, place);
                          member = static_cast<std::decay_t<decltype(member)>>(place + First);
                          return status;
                      },
                      [](const Key& key, const Settings& settings) {
                          return write_word(key,
                                            static_cast<int>(settings.network.*Member) - First);
                      }};

/// Rules of config_file.cpp read the head's name.
inline constexpr auto kHeadNames = head_names();
inline constexpr Field kWordOfHead{KeyType::kChoice, Part::kNetwork};
inline constexpr Field kLikeHead{
    KeyType::kChoice, Part::kNetwork, nullptr, [](const Key&, const Settings& settings) {
        return ConfigEntry{"", {settings.network.head_name}, false, false};
    }};

inline constexpr Key kHeadKeys[] = {
    {"model.head", kWordOfHead, words(kHeadNames.data()), kOurs,
     "How channels of the network become Gaussians: a word, or a map of the keys below, whose "
     "first is that word.",
     "\"splatter\""},
    {"model.head.like", kLikeHead, words(kHeadNames.data()), kOurs,
     "The head whose values hold for keys that are not given."},
    {"model.head.positions", kWord<&P::positions, kHeadRayDepth>,
     words("ray_depth, input_depth, box"), kOurs,
     "Where means are: at a depth of the network along the pixel's ray, at one that an input gives "
     "in scene units, or in a box."},
    where(
        kDepths,
        {"model.head.depth_maps", kWord<&P::depth_farther, 0>, words("nearer, farther"), kOurs,
         "What larger numbers of a picture's depth map are, whose least and greatest lie at "
         "data.znear and data.zfar: nearer, relative inverse depths, as in data sets; or farther, "
         "relative depths."}),
    {"model.head.scales", kWord<&P::scales, kHeadExp>, words("exp, softplus"), kOurs,
     "Scales are exp(x), or log(1 + exp(x)) / 10."},
    {"model.head.colours", kWord<&P::direct, 0>, words("harmonics, direct"), kOurs,
     "Colours are coefficients of spherical harmonics, or tanh(x) / 2 + 1 / 2 of degree 0."},
    {"model.head.per_pixel", kNetwork<&P::per_pixel>, {1, 4}, kOurs, "Gaussians of a pixel."},
    where(kBoxed, {"model.head.box", kNetwork<&P::box>, above(0), kOurs,
                   "Half a side of the box that means are in, in scene units."}),
    {"model.head.opacity_threshold", kNetwork<&P::opacity_threshold>, below(0, 1), kOurs,
     "Scenes leave fainter Gaussians out."},
};

}  // namespace splat::config::rows
