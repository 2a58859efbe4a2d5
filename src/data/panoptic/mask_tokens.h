#pragma once

#include <span>
#include <string>
#include <vector>

#include "data/panoptic/mask_names.h"

namespace splat::data {

/// Numbers of a token after those of its class: sine and cosine of the instance, box, area, presence.
inline constexpr std::uint32_t kTokenExtras = 8;
inline constexpr std::uint32_t kMostTokenDimension = 4096;

struct MaskTokensDesc {
    std::string data, format, category;  ///< the data set, see DatasetDesc
    /// Folder of the masks: SPLIT/OBJECT/, of a data set without splits OBJECT/; the PNG files there are those of the
    /// views, in their order.
    std::string masks;
    std::string names;             ///< see MaskNames::load()
    std::string out;               ///< .npz or .safetensors, see ViewVectors
    std::uint32_t dimension = 32;  ///< numbers of a token
    std::uint32_t tokens = 16;     ///< tokens of a view
    bool pooled = false;           ///< one vector for each view instead
};

struct MaskTokens {
    std::uint32_t classes = 0;  ///< names that occurred
    std::uint32_t objects = 0;
    std::uint64_t views = 0;
    std::uint64_t segments = 0;  ///< segments of all masks
    std::uint64_t dropped =
        0;  ///< the smallest segments of views that have more than there are tokens
};

/// The token of a segment. Numbers of the class come first: sines and cosines of angles that philox() draws from the
/// hash of its name, so that a name has the same code in every file. Then sine and cosine of the instance's number (0
/// for the first of its class in the picture); centre, width and height of the box and the area as shares of the
/// picture; and 1. Tokens that a view lacks are 0.
std::vector<float> token_of(const Segment& segment, std::uint32_t instance, std::uint32_t width,
                            std::uint32_t height, std::uint32_t dimension);

/// The tokens of a view [dimension, tokens], or with `pooled` the sum of all of them, each times its share of the
/// picture: [dimension].
std::vector<float> tokens_of(std::span<const Segment> segments, std::uint32_t width,
                             std::uint32_t height, const MaskTokensDesc& desc);

/// Write the tokens of all splits of a data set: arrays that ViewVectors reads. An existing file is replaced.
///
/// Errors  kInvalidArgument for the desc; those of Dataset::open() and MaskNames, with the mask; kNotFound for a folder
///         without masks; kFormat for another number of masks than views, and for a mask of another size than the
///         picture; kUnsupported for more than 2 GiB; as io::save_weights()
Result<MaskTokens> write_mask_tokens(const MaskTokensDesc& desc);

}  // namespace splat::data
