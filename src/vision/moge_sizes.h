#pragma once

#include "io/tensor_file.h"
#include "vision/vit.h"

namespace splat::vision {

/// Normalisation before an activation of a residual block.
enum class BlockNorm { kNone, kLayer, kGroup };  // kLayer: over all; kGroup: groups of 32 channels

/// A stack of convolutions, each level of twice the size of the one before.
struct StackSizes {
    std::string name;                   ///< "neck", "points_head", ...
    std::vector<std::uint32_t> inputs;  ///< by level, channels of its input
    std::vector<std::uint32_t> widths;  ///< by level
    std::vector<std::uint32_t> blocks;  ///< by level, residual blocks
    std::vector<bool>
        transposed;  ///< by level but the last: to the next by a transposed convolution, else bilinearly
    std::uint32_t out =
        0;  ///< channels of the last level's result; 0: all levels give their widths
    BlockNorm in_norm = BlockNorm::kNone, hidden_norm = BlockNorm::kNone;
};

struct MogeSizes {
    VitSizes encoder;
    StackSizes neck;
    std::vector<StackSizes> heads;  ///< points and mask, and normals where the network has them
    std::vector<std::uint32_t>
        scale;  ///< widths of the MLP from the class token to the logarithm of the metric scale
    [[nodiscard]] std::uint32_t levels() const {
        return static_cast<std::uint32_t>(neck.widths.size());
    }
};

/// What shapes do not tell. Of DINOv2 and the published networks by default.
struct MogeConfig {
    std::uint32_t heads = 0;               ///< attention heads; 0: one for each 64 channels
    std::vector<std::uint32_t> taps = {};  ///< empty: evenly spaced, the last block one of them
    BlockNorm in_norm = BlockNorm::kLayer,
              hidden_norm = BlockNorm::kGroup;  ///< where blocks have one
};

/// The configuration that a file carries as JSON under "model_config"; the default without one. Errors: kFormat, naming
/// the member, for what this network does not do.
Result<MogeConfig> moge_config(const io::Metadata& metadata);

/// The sizes of the network whose tensors these are. Only those are looked at that decide a size. Errors: kFormat for
/// tensors of another network (the message says which they look like), and for one that is missing or of a shape that
/// no size fits.
Result<MogeSizes> moge_sizes(const io::NamedTensors& tensors, const MogeConfig& config);

/// The preset of a published network of these sizes; empty for another.
std::string moge_preset(const MogeSizes& sizes);

}  // namespace splat::vision
