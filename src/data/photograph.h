#pragma once

#include <array>
#include <string>

#include "io/image.h"

namespace splat::data {

struct PhotographDesc {
    std::string image;                ///< path
    std::string depth, normal, mask;  ///< paths of maps of the same size; empty: none
    std::uint32_t resolution = 128;   ///< of the result
    bool crop = true;                 ///< to the object; else to the largest square in the middle
    double foreground = 0.65;         ///< the object's longer side, as a part of the square's
    std::array<float, 3> background{1, 1, 1};
};

/// One object on a plain background, the input of networks; R is the resolution.
struct Photograph {
    std::vector<float> image;             ///< [3,R,R], 0 to 1
    std::vector<float> depth;             ///< [1,R,R], 0 to 1; empty without a map
    std::vector<float> normal;            ///< [3,R,R], 0 to 1; empty without a map
    std::vector<float> mask;              ///< [1,R,R], 0 to 1
    std::uint32_t width = 0, height = 0;  ///< of the file
    const char* mask_from = "";     ///< "mask", "alpha", "border" or "nothing": the whole image
    double x = 0, y = 0, side = 0;  ///< the square that was cut out, pixels of the file
};

/// Cut an object out of a picture and put it in the middle of a square on a plain background, as
/// Splatter Image's demonstration does: the object's bounding box takes `foreground` of the side.
///
/// The mask file, else the image's alpha, marks the object (above a half). Without both, the background is
/// flooded from the border, over colours within 0.1 of the border's median; if less than 1 % or more than
/// 95 % remains, the whole image is the object.
///
/// Errors       kInvalidArgument with the path: a file that cannot be read, maps of another size, an
///              empty mask
/// Determinism  the same bits on every run
/// Source       preprocessing of Splatter Image's demonstration (foreground ratio 0.65, white, Lanczos)
Result<Photograph> read_photograph(const PhotographDesc& desc);

}  // namespace splat::data
