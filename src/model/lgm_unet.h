#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "model/song_unet.h"

namespace splat::model {

/// Builds the layers of LGM's asymmetric U-Net into a graph: images of several views of an object, whose pixels attend
/// to each other in some levels, to channels of a head at the resolution of its last level. Parameters have the names
/// of its state dict. Sizes: config::LgmUnetConfig.
///
/// Source  Tang et al. 2024, arXiv:2402.05054, section 3.3; order of layers and names: its published code
class LgmUnet : NoCopy {
  public:
    LgmUnet(nn::Graph& graph, const ModelConfig& config, const BuildOptions& options)
        : graph_(graph), config_(config), options_(options) {}

    /// x          [N, 9, R, R], the views of an object consecutive
    /// Each layer with its activations is a segment of the graph (Graph::begin_segment).
    /// Returns    [N, output_channels, output_resolution, output_resolution]; the graph's status has the errors:
    ///            those of operators, and kInvalidArgument for a part of opt.freeze that occurs in no name
    nn::ValueId build(nn::ValueId x);

    /// The same channels for a world with the axes of scenes (right, down, front) instead of the network's (right, up,
    /// back): some change their sign. Channels of heads along rays, which are in the camera's axes, stay.
    nn::ValueId turned(nn::ValueId raw);

    /// Inputs of the graph that this class has made, with the values that they keep.
    using Constant = std::pair<nn::ValueId, std::vector<float>>;
    [[nodiscard]] const std::vector<Constant>& constants() const { return constants_; }

    /// Initial values of each parameter, by name.
    [[nodiscard]] const std::map<std::string, Init>& inits() const { return inits_; }

  private:
    nn::ValueId encode(nn::ValueId x, std::vector<nn::ValueId>& skips);
    nn::ValueId decode(nn::ValueId x, std::vector<nn::ValueId>& skips);
    nn::ValueId layer(const std::string& block, int number, nn::ValueId x, std::uint32_t out,
                      bool attends);
    nn::ValueId net(const std::string& name, nn::ValueId x, std::uint32_t out);
    nn::ValueId attention(const std::string& name, nn::ValueId x);
    nn::ValueId norm(const std::string& name, nn::ValueId x, bool silu);
    nn::ValueId conv(const std::string& name, nn::ValueId x, std::uint32_t out,
                     std::uint32_t kernel, nn::ValueId residual = nn::kNoValue);
    nn::ValueId linear(const std::string& name, nn::ValueId x, std::uint32_t out, bool bias,
                       nn::ValueId residual = nn::kNoValue);
    nn::ValueId convolve(nn::ValueId x, nn::ValueId weight, nn::ValueId bias, nn::ValueId residual);
    nn::ValueId parameter(const std::string& name, const Shape& shape, const Init& init);
    [[nodiscard]] std::uint32_t channels(nn::ValueId x) const { return graph_.value(x).shape[1]; }

    nn::Graph& graph_;
    const ModelConfig& config_;
    BuildOptions options_;
    std::map<std::string, Init> inits_;
    std::vector<Constant> constants_;
};

}  // namespace splat::model
