#pragma once

#include <array>
#include <optional>
#include <string>

#include "io/image.h"

namespace splat::data {

/// Which square of a picture becomes the input of a network, and how.
struct CutOptions {
    std::uint32_t resolution = 128;  ///< side of the result, pixels
    bool crop = true;                ///< to the object; else to the largest square in the middle
    double foreground = 0.65;        ///< the object's longer side, as a part of the square's
    std::array<float, 3> background{1, 1, 1};
    bool flood = true;  ///< false: without mask and alpha the whole picture is the object
    bool depth = true;  ///< false: the depth map is not cut out
};

/// A decoded image and how messages call it: its path in quotes, or what it is.
struct NamedImage {
    io::Image image;
    std::string name;
    std::vector<float> exact = {};  ///< a depth map's numbers before they became 8 bits; or empty
};

/// A picture of one object, with its maps where there are any; all of one size.
struct Picture {
    NamedImage image;
    std::optional<NamedImage> depth, normal, mask;
};

/// Where the object's mask comes from.
enum class MaskFrom : int {
    kMask = 1,
    kAlpha,
    kBorder,   ///< pixels that are not joined to the border by its colour
    kNothing,  ///< the whole picture
};
const char* mask_from_name(MaskFrom from);  ///< "mask", "alpha", "border", "nothing"

/// One object on a plain background, the input of networks; R is the resolution.
struct Photograph {
    std::vector<float> image;             ///< [3,R,R], 0 to 1
    std::vector<float> depth;             ///< [1,R,R], 0 to 1; empty without a map
    std::vector<float> normal;            ///< [3,R,R], 0 to 1; empty without a map
    std::vector<float> mask;              ///< [1,R,R], 0 to 1
    std::uint32_t width = 0, height = 0;  ///< size of the picture
    MaskFrom mask_from = MaskFrom::kNothing;
    bool at_border = false;         ///< an object was found, and it reaches the picture's border
    double x = 0, y = 0, side = 0;  ///< the square that was cut out, pixels of the picture
};

/// Cut an object out of a picture and put it in the middle of a square on a plain background, as
/// Splatter Image's demonstration does: the object's bounding box takes `foreground` of the side.
///
/// The mask, else an alpha that is not above a half everywhere, marks the object (above a half). Without both, the
/// background is flooded from the border (unless options.flood is false), over colours within 0.1 of the border's
/// median; if less than 1 % or more than 95 % remains, the whole image is the object. Samples of 16 bits are reduced
/// to 8.
///
/// Errors       kInvalidArgument with the name: maps of another size, an empty mask
/// Determinism  the same bits on every run
/// Source       preprocessing of Splatter Image's demonstration (foreground ratio 0.65, white, Lanczos)
Result<Photograph> cut_photograph(const Picture& picture, const CutOptions& options);

/// The object's mask without a map of it, 0 to 255 for each pixel of an image of 8 or 16 bits: an alpha that is not
/// above a half everywhere, else what the flood leaves, else 255 everywhere. `from` says which.
Result<std::vector<std::uint8_t>> mask_of(const io::Image& image, MaskFrom& from);

/// Read a picture of any format and turn it by its Exif orientation. Errors: those of io::load_image().
Result<NamedImage> load_picture(const std::string& path);

}  // namespace splat::data
