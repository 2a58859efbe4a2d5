// How the channels of a network's output become Gaussians: which blocks of channels there are, in which order, and what
// is done to each. Written here only, for the library, kernels, references and tools. C++ has the table; kernels
// get what follows from it as specialisation constants.

#ifndef SPLAT_GAUSSIAN_HEAD_PARAMS_H
#define SPLAT_GAUSSIAN_HEAD_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <array>
#include <cstdint>
#define SPLAT_HEAD_CONST inline constexpr std::uint32_t
namespace splat {
#else
#define SPLAT_HEAD_CONST const uint
#endif

// Where means come from: a channel's depth between `least` and `most` along the pixel's ray; the depth of each pixel,
// which an input gives, along its ray; or channels from `least` to `most` on each axis of the world, whose frame
// rotations and coefficients are in, too.
SPLAT_HEAD_CONST kHeadRayDepth = 0u;
SPLAT_HEAD_CONST kHeadInputDepth = 1u;
SPLAT_HEAD_CONST kHeadBox = 2u;

// What is done to a block's channels.
SPLAT_HEAD_CONST kHeadIdentity = 0u;
SPLAT_HEAD_CONST kHeadSigmoid = 1u;
SPLAT_HEAD_CONST kHeadExp = 2u;
SPLAT_HEAD_CONST kHeadSoftplus = 3u;   // log(1 + exp(x)) / 10
SPLAT_HEAD_CONST kHeadTanh = 4u;       // tanh(x) / 2 + 1 / 2
SPLAT_HEAD_CONST kHeadNormalise = 5u;  // x / max(|x|, 1e-12)
SPLAT_HEAD_CONST kHeadClamp = 6u;      // from `least` to `most`

#ifdef __cplusplus
/// The blocks, in the order of their channels.
enum HeadBlockId : std::uint32_t {
    kHeadDepth,
    kHeadPoint,  ///< moves the point off its ray, or is the point itself
    kHeadOpacity,
    kHeadScale,
    kHeadRotation,  ///< (w,x,y,z)
    kHeadColour,    ///< the first coefficient of red, green and blue, or these themselves
    kHeadRest,      ///< [3 coefficients of degree 1][3 colours]
    kHeadBlocks
};

struct HeadBlock {
    const char* name;
    std::uint32_t channels;  ///< a Gaussian has so many; 0: no such block
    std::uint32_t activation;
    float gain = 1;  ///< initial weights are scaled by it
    float bias = 0;  ///< initial value
};

/// What a head is made from.
struct HeadForm {
    std::uint32_t positions = kHeadRayDepth;
    bool offset = true;  ///< along rays: three channels move each point off its ray
    float least = 0.8F;  ///< depth, or coordinate of kHeadBox
    float most = 1.8F;
    std::uint32_t scales = kHeadExp;  ///< or kHeadSoftplus
    bool isotropic = false;           ///< the first scale serves for all three
    std::uint32_t sh_degree = 1;      ///< 0 or 1
    bool direct = false;   ///< colours are red, green, blue: degree 0 with (rgb - 1/2) / kSh0
    bool activate = true;  ///< false: opacities, scales and direct colours as they are
    std::uint32_t per_pixel = 1;  ///< Gaussians of a pixel, all blocks of one behind the other
};

struct HeadLayout : HeadForm {
    std::array<HeadBlock, kHeadBlocks> blocks;

    constexpr explicit HeadLayout(const HeadForm& form = {})
        : HeadForm(form),
          blocks{{
              {"depth", positions == kHeadRayDepth ? 1U : 0U, kHeadSigmoid},
              {"point", offset || absolute() ? 3U : 0U, absolute() ? kHeadClamp : kHeadIdentity},
              {"opacity", 1, activate ? kHeadSigmoid : kHeadIdentity},
              {"scale", 3, activate ? scales : kHeadIdentity},
              {"rotation", 4, kHeadNormalise},
              {"colour", 3, direct && activate ? kHeadTanh : kHeadIdentity,
               direct ? 1.0F : 5.0F},
              {"rest", 9 * sh_degree, kHeadIdentity, 0},
          }} {}

    [[nodiscard]] constexpr bool absolute() const { return positions == kHeadBox; }
    /// Channels of a Gaussian before a block.
    [[nodiscard]] constexpr std::uint32_t at(std::uint32_t block) const {
        std::uint32_t first = 0;
        for (std::uint32_t i = 0; i < block; ++i) first += blocks[i].channels;
        return first;
    }
    [[nodiscard]] constexpr std::uint32_t channels_of_one() const { return at(kHeadBlocks); }
    /// Channels of the network's output.
    [[nodiscard]] constexpr std::uint32_t channels() const { return per_pixel * channels_of_one(); }
    /// Coefficients of each colour.
    [[nodiscard]] constexpr std::uint32_t coefficients() const { return 1 + 3 * sh_degree; }
    /// Gaussians of so many square images.
    [[nodiscard]] constexpr std::uint32_t gaussians(std::uint32_t images,
                                                    std::uint32_t side) const {
        return images * side * side * per_pixel;
    }
};
}  // namespace splat
#endif
#undef SPLAT_HEAD_CONST

#ifdef __cplusplus
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kGaussianHeadPositionsId = 10u;
SPLAT_SPEC_ID kGaussianHeadOffsetId = 11u;  // 1: three channels move the point off its ray
SPLAT_SPEC_ID kGaussianHeadDegreeId = 12u;  // degree of the spherical harmonics, 0 or 1
SPLAT_SPEC_ID kGaussianHeadDirectId = 13u;  // 1: colours are red, green and blue
SPLAT_SPEC_ID kGaussianHeadPerPixelId = 14u;
SPLAT_SPEC_ID kGaussianHeadChannelsId = 15u;  // a Gaussian has so many
SPLAT_SPEC_ID kGaussianHeadOpacityActivationId = 16u;
SPLAT_SPEC_ID kGaussianHeadScaleActivationId = 17u;
SPLAT_SPEC_ID kGaussianHeadColourActivationId = 18u;
// A Gaussian's channels before each block, in the order of the table.
SPLAT_SPEC_ID kGaussianHeadDepthAtId = 19u;
SPLAT_SPEC_ID kGaussianHeadPointAtId = 20u;
SPLAT_SPEC_ID kGaussianHeadOpacityAtId = 21u;
SPLAT_SPEC_ID kGaussianHeadScaleAtId = 22u;
SPLAT_SPEC_ID kGaussianHeadRotationAtId = 23u;
SPLAT_SPEC_ID kGaussianHeadColourAtId = 24u;
SPLAT_SPEC_ID kGaussianHeadRestAtId = 25u;

struct GaussianHeadParams {
    uint images;  // batch * views
    uint pixels;  // pixels per image
    float least;  // depth, or coordinate of a box
    float most;
    uint isotropic;  // 1: all three scales come from the first channel
    uint has_focal;
    uint has_origin;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(GaussianHeadParams) <= 128);
}
#endif

#endif
