#pragma once

#include <map>
#include <string>

#include "config/model_config.h"
#include "model/init.h"
#include "nn/graph.h"

namespace splat::model {

using config::Embedding;
using config::Film;
using config::LoraConfig;
using config::ModelConfig;
using config::Precision;

/// Options of building a network, in addition to its configuration.
struct BuildOptions {
    bool training = false;  ///< dropout acts
    Precision precision = Precision::kBalanced;
};

/// Groups of channels of a normalisation: at most 32, of at least 4 channels.
std::uint32_t norm_groups(std::uint32_t channels);

/// Builds the layers of Song et al.'s U-Net (the "DDPM++" variant without noise conditioning) into a
/// graph, as Splatter Image configures it. Parameters have the names of its state dict.
///
/// Source  Song et al. 2021, arXiv:2011.13456; Karras et al. 2022, arXiv:2206.00364, appendix;
///         Szymanowicz et al. 2024, arXiv:2312.13150
class SongUnet : NoCopy {
  public:
    SongUnet(nn::Graph& graph, const ModelConfig& config, const BuildOptions& options)
        : graph_(graph), config_(config), options_(options) {}
    virtual ~SongUnet() = default;

    /// x          [N, image_channels, R, R]
    /// embedding  [N, embedding_length], halves as the reference feeds them; kNoValue if there is none
    /// tokens     [N, token_dim, T]; kNoValue if there are none
    /// counter    [4] row-major, of the dropout's generator; kNoValue unless training
    /// Each block is a segment of the graph (Graph::begin_segment).
    /// Returns    [N, output_channels, R, R]; the graph's status has the errors: those of operators, and
    ///            kInvalidArgument for a part of a name (ModelConfig) that occurs in no name
    nn::ValueId build(nn::ValueId x, nn::ValueId embedding, nn::ValueId tokens,
                      nn::ValueId counter);

    /// Initial values of each parameter, by name.
    [[nodiscard]] const std::map<std::string, Init>& inits() const { return inits_; }

  protected:  // single layers, for tests against other implementations
    struct BlockShape {
        std::uint32_t in = 0;
        std::uint32_t out = 0;
        bool up = false;
        bool down = false;
        bool attention = false;
        bool tokens = false;  ///< attends to tokens, if there are any
    };

    nn::ValueId block(const std::string& name, nn::ValueId x, const BlockShape& shape);
    nn::ValueId conv(const std::string& name, nn::ValueId x, std::uint32_t out,
                     std::uint32_t kernel, const Init& init, nn::ValueId residual = nn::kNoValue,
                     float scale = 1, bool adapted = false, const Init& bias = {});
    nn::ValueId resample(nn::ValueId x, bool up);
    virtual nn::ValueId dropout(nn::ValueId x, float p);

    nn::Graph& graph_;
    nn::ValueId embedding_ = nn::kNoValue;
    nn::ValueId tokens_ = nn::kNoValue;
    nn::ValueId counter_ = nn::kNoValue;

  private:
    [[nodiscard]] Status check_names() const;
    nn::ValueId encode(nn::ValueId x, std::vector<nn::ValueId>& skips);
    nn::ValueId decode(nn::ValueId x, std::vector<nn::ValueId>& skips);
    nn::ValueId modulate(const std::string& name, nn::ValueId x, std::uint32_t channels);
    nn::ValueId self_attention(const std::string& name, nn::ValueId x);
    nn::ValueId token_attention(const std::string& name, nn::ValueId x);
    nn::ValueId convolve(nn::ValueId x, nn::ValueId weight, nn::ValueId bias, nn::ValueId residual,
                         double scale);
    nn::ValueId lora(const std::string& name, nn::ValueId x, std::uint32_t out,
                     std::uint32_t kernel, nn::ValueId residual);
    nn::ValueId linear(const std::string& name, nn::ValueId x, std::uint32_t out,
                       const Init& bias = {});
    nn::ValueId norm(const std::string& name, nn::ValueId x, bool silu, int times = 1);
    nn::ValueId parameter(const std::string& name, const Shape& shape, const Init& init);
    [[nodiscard]] std::uint32_t channels(nn::ValueId x) const { return graph_.value(x).shape[1]; }
    [[nodiscard]] bool attends(std::uint32_t resolution) const;

    const ModelConfig& config_;
    BuildOptions options_;
    std::map<std::string, Init> inits_;
    std::int64_t dropouts_ = 0;  ///< layers so far: the generator's stream
};

}  // namespace splat::model
