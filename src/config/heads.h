#pragma once

#include <array>
#include <span>

#include "config/model_config.h"

namespace splat::config {

/// One way from the channels of a network to Gaussians, by its name in model.head. Keys that a configuration does not
/// give have its values.
struct Head {
    const char* name;
    HeadForm
        form;  ///< without `least` and `most`, which are data.znear and data.zfar, or model.head.box
    HeadInit depth, offset, opacity,
        scale;                ///< how weights start; the scale's bias is the scale itself
    float opacity_threshold;  ///< model.head.opacity_threshold
};

/// Every head; the first is that of configurations without model.head. A new one is one row.
inline constexpr Head kHeads[] = {
    // Szymanowicz et al. 2024, as the cars model has it.
    {"splatter", {}, {1, 0}, {1e-6F, 0}, {0.001F, -3}, {0.001F, 0.02F}, 0},
    // W-Ted/F3D-Gaus 8e52aec: depths are an input in scene units.
    {"f3d", {.positions = kHeadInputDepth}, {1, 0}, {1e-6F, 0}, {0.001F, -3}, {0.0005F, 0.01F}, 0},
    // 3DTopia/LGM fe8d12c: points of a box of 2 units, which it starts at the middle; 0.0693 is log(2) / 10.
    {"lgm",
     {.positions = kHeadBox, .scales = kHeadSoftplus, .sh_degree = 0, .direct = true},
     {1, 0},
     {1, 0},
     {1, 0},
     {1, 0.06931472F},
     0.005F},
};

/// "splatter, f3d, lgm" in an array that ends with 0.
constexpr auto head_names() {
    std::array<char, 256> names{};
    std::size_t at = 0;
    for (const Head& head : kHeads) {
        for (const char* each = at == 0 ? "" : ", "; *each != '\0'; ++each) names[at++] = *each;
        for (const char* each = head.name; *each != '\0'; ++each) names[at++] = *each;
    }
    return names;
}

void take_head(const Head& head, ModelConfig& config);

}  // namespace splat::config
