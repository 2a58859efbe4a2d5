#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/status.h"
#include "params/gaussian_head_params.h"

namespace splat::config {

/// Which kernels convolutions may use; errors and times of each: BENCHMARKS.md.
enum class Precision : int { kStrict, kBalanced, kFast };

/// What modulates the blocks of the network, see model/song_unet.h.
enum class Embedding : int { kNone, kPose, kIndex, kCustom };

/// How an embedding enters a block.
enum class Film : int {
    kReference,  ///< needed by published weights: shift only, norm and activation run twice
    kAffine,     ///< gamma * norm(x) + beta, equation 1 of the report
};

/// The rank of adapters that the published code always takes.
inline constexpr std::uint32_t kPublishedRank = 4;

/// Low-rank adapters, see Hu et al. 2021, arXiv:2106.09685.
struct LoraConfig {
    std::uint32_t rank = 0;  ///< 0 = none
    float alpha = 1;         ///< the branch is scaled by alpha / rank
    float dropout = 0;       ///< drops the branch's input, while training
    /// Layers with an adapter: those whose name contains one of these. Default: the convolutions of
    /// blocks that do not resample, and the attention's two. Others that may be named: the first
    /// convolution, and the linear layers of an embedding, "affine" and "map_layer".
    std::vector<std::string> targets = {"conv0", "conv1", "qkv", "proj"};
    /// Parameters that are trained besides the adapters: their names contain one of these, such
    /// as "128x128_conv." for the first convolution, whose new channels have no influence
    /// otherwise.
    std::vector<std::string> trained;
};

/// Which network makes the head's channels.
enum class Network : int {
    kSongUnet,  ///< Splatter Image and F3D-Gaus: model/song_unet.h
    kLgmUnet,   ///< LGM
};

/// Sizes of LGM's network. One entry of a list is a level, from the image inwards and back.
struct LgmUnetConfig {
    static constexpr int kDownNets = 2;  ///< nets of a level inwards; one more on the way back
    static constexpr std::uint32_t kGroups = 32;              ///< each normalisation has so many
    static constexpr std::uint32_t kHeads = 16;               ///< each attention has so many
    std::vector<std::uint32_t> down, up;                      ///< channels
    std::vector<std::uint32_t> down_attention, up_attention;  ///< 1: the level has attention
};

/// One group of output channels of the network and how its weights start.
struct HeadInit {
    float scale;
    float bias;
};

/// Everything that the network's shape and the geometry of its Gaussians depend on. The defaults are
/// those of the cars model. config_keys.cpp says which key is which field.
struct ModelConfig {
    Network network = Network::kSongUnet;
    LgmUnetConfig lgm;  ///< kLgmUnet has these instead of base_dim and what follows it

    std::uint32_t resolution = 128;  ///< pixels, both ways; divisible by 2^(levels - 1)
    /// Pixels of the image whose network this is: names of its levels and attention_resolutions are for this size. 0:
    /// resolution. F3D-Gaus is built for 128 and takes 256.
    std::uint32_t named_resolution = 0;
    bool depth = false;   ///< a channel of depth follows RGB
    bool normal = false;  ///< three channels of normals follow
    bool mask = false;    ///< a channel of object mask follows
    bool plane = false;   ///< five channels of planes follow, of data::plane_channels
    bool origin_distance =
        false;                ///< CO3D: a last plane, added to the depth, unseen by the network
    std::uint32_t views = 1;  ///< input images per object
    bool cross_view_attention = true;

    std::uint32_t base_dim = 128;
    std::uint32_t num_blocks = 4;
    std::vector<std::uint32_t> channel_mult = {1, 2, 2, 2};
    std::vector<std::uint32_t> attention_resolutions = {16};
    float dropout = 0.1F;

    Embedding embedding = Embedding::kNone;
    std::uint32_t embedding_dim = 10;  ///< sines and cosines per scalar of the pose
    Film film = Film::kReference;
    std::uint32_t token_dim = 0;  ///< features of the tokens that the decoder attends to; 0 = none
    std::uint32_t tokens = 0;     ///< tokens per image

    std::string head_name =
        "splatter";  ///< row of heads.h whose values hold for keys that are not given
    std::uint32_t positions = kHeadRayDepth;  ///< kHeadInputDepth: of a last plane, in scene units
    /// What larger numbers of a picture's map are: false, nearer, relative inverse depths; true, farther, relative
    /// depths.
    bool depth_farther = false;
    std::uint32_t scales = kHeadExp;
    bool direct = false;          ///< colours are red, green and blue; degree 0
    std::uint32_t per_pixel = 1;  ///< Gaussians of a pixel
    float box = 1;                ///< kHeadBox: means are from -box to box on each axis
    float opacity_threshold = 0;  ///< scenes leave fainter Gaussians out
    std::uint32_t sh_degree = 1;  ///< 0 or 1
    bool isotropic = false;
    bool offset = true;  ///< the network moves Gaussians off their rays
    float znear = 0.8F;  ///< scene units
    float zfar = 1.8F;
    float fov_degrees = 51.98948897809546F;  ///< 0: per-view focal lengths (CO3D)
    bool inverted_x = false;
    bool inverted_y = true;

    HeadInit init_depth{1.0F, 0.0F};
    HeadInit init_offset{1e-6F, 0.0F};
    HeadInit init_opacity{0.001F, -3.0F};
    HeadInit init_scale{0.001F, 0.02F};  ///< bias: the scale itself, in scene units

    LoraConfig lora;
    /// Parameters whose name contains one of these are never trained and get no gradient.
    std::vector<std::string> frozen;

    /// Channels that the network sees: RGB, depth, normal, mask, planes; of kLgmUnet RGB as ImageNet normalises it, and
    /// o x d and d of the ray of each pixel.
    [[nodiscard]] std::uint32_t image_channels() const;

    /// Channels of an input image: those and the origin distance, or the depth of kHeadInputDepth.
    [[nodiscard]] std::uint32_t input_channels() const;

    /// How channels of the network's output become Gaussians, and how their weights start.
    [[nodiscard]] HeadLayout head() const;

    /// Channels of the network's output.
    [[nodiscard]] std::uint32_t output_channels() const { return head().channels(); }

    /// named_resolution, or resolution where that is 0.
    [[nodiscard]] std::uint32_t names_resolution() const {
        return named_resolution == 0 ? resolution : named_resolution;
    }

    /// Pixels of a side of the network's output.
    [[nodiscard]] std::uint32_t output_resolution() const;

    /// Gaussians of an object.
    [[nodiscard]] std::uint32_t gaussians() const {
        return head().gaussians(views, output_resolution());
    }

    /// Length of the vector that modulates blocks; 0 = none.
    [[nodiscard]] std::uint32_t embedding_length() const;

    /// Prefix of the names of all parameters, as in the published code.
    [[nodiscard]] const char* network_name() const {
        return offset ? "network_with_offset" : "network_wo_offset";
    }

    [[nodiscard]] std::uint32_t levels() const {
        return static_cast<std::uint32_t>(channel_mult.size());
    }
};

/// The ranges of config_keys.h, and the rules that take several keys.
/// Errors: kInvalidArgument, naming the key, what it is and what is expected.
Status check(const ModelConfig& config);

}  // namespace splat::config
