#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace vkrun {

/// Gaussians of a scene as page/ reads them: planes of `count` texels of three 32-bit words, little-endian.
///
/// plane 0  the mean, float32
/// plane 1  log scales, 11, 11 and 10 bits of `log_scale` (least value, extent); the rotation: three components by
///          10 bits, v / sqrt(1/2) * 511 + 511, and 2 bits for the largest, which is left out; colour and opacity, 8
///          bits each: 0.5 + Y00 sh, linear between the codes 0, 8, 247 and 255, which mean the values of `color`;
///          and 0 to 1
/// plane 2  on  coefficients of degree 1 and more, four of three colours in a texel, 8 bits each: a signed code, and
///          with s = |code| / 127 the coefficient is limit s^2 + beyond max(0, s - 119 / 127) with its sign; `sh_limit`
///          and `sh_beyond` of each degree
///
/// A Gaussian takes 24 bytes, and 12, 24 or 48 of degree 1, 2 or 3.
struct ScenePayload {
    std::vector<std::uint32_t> words;
    Json
        facts;  ///< count, faint (what cannot be seen), degree, log_scale, color, sh_limit, sh_beyond,
                ///< center, radius
    std::uint32_t drawn_as = 0;      ///< SPLAT_DRAWN_ bits of the scene
    std::vector<std::string> notes;  ///< sentences on what else was left out or changed
};

/// What is left out: Gaussians with numbers that are not finite or rotations of length 0, those that cannot be seen
/// (opacity below 1/255), and where more than `most` remain the least of them by opacity times the area of the two
/// largest axes.
/// `scene` loses what is not finite or cannot be seen. Throws a Failure if nothing remains.
ScenePayload pack_scene(splat_scene scene, std::uint64_t most);

}  // namespace vkrun
