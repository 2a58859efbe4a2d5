#pragma once

#include <functional>
#include <string>
#include <vector>

#include "second_golden/tape.h"

namespace splat::golden {

using Id = Tape::Id;

/// The kind of a parameter, for the function that fills it with numbers.
enum class Role { kWeight, kBias, kScale };

/// Sizes and parts of a residual block.
struct BlockSpec {
    std::size_t in = 0;
    std::size_t out = 0;
    bool up = false;
    bool down = false;
    bool attention = false;
    std::size_t views = 1;  ///< views that attend to each other
    Id emb = Tape::kNone;
    Values mask = {};  ///< multiplied onto the tensor before conv1; empty: none
};

/// The layers that tests/golden/net/INDEX.md describes, on a tape. Written from the index, not from the
/// library's graph.
class Layers {
  public:
    /// `parameter` makes the leaf of that name and shape.
    using Parameter = std::function<Id(const std::string& name, const Dims& dims, Role role)>;

    Layers(Tape& tape, Parameter parameter) : tape_(tape), parameter_(std::move(parameter)) {}

    std::size_t rank = 0;  ///< rank of adapters; 0 = none
    double scaling = 0;

    [[nodiscard]] static std::size_t groups_of(std::size_t channels);

    Id norm(const std::string& name, Id x, std::size_t groups, double eps, bool silu);
    Id conv(const std::string& name, Id x, std::size_t out, std::size_t kernel,
            bool adapted = false);
    Id linear(const std::string& name, Id x, std::size_t out, bool adapted = false);
    /// The adapter as a branch of its own, for a mask on its input: x W^T + b + scaling ((x * mask) A^T) B^T.
    Id masked_linear(const std::string& name, Id x, std::size_t out, const Values& mask);
    Id resample(Id x, bool up, const Values& filter = {1, 1});
    Id attention(Id q, Id k, Id v);
    Id block(const std::string& name, Id x, const BlockSpec& spec);

    /// x, and keys and values of kv: norm, q_proj, kv_proj and out_proj of the name's prefix.
    Id cross_attention(Id q, Id kv, std::size_t groups, std::size_t kernel);

    /// A U-Net of square images with the names of Splatter Image's state dict.
    struct Network {
        std::size_t base = 4;
        std::size_t blocks = 1;
        std::vector<std::size_t> mult = {1, 2, 2, 2};
        std::vector<std::size_t> attention = {};  ///< resolutions
        std::size_t views = 1;
        std::size_t out = 24;  ///< channels
    };
    Id network(Id x, const Network& network);

  private:
    Id adapted_weight(const std::string& name, const Dims& shape, bool adapted);
    Id self_attention(const std::string& name, Id x, std::size_t views);
    /// Channel `3 * i + part` of each three.
    Id every(Id x, std::size_t of, std::size_t part);
    /// Views below one another in one image, and back.
    Id joined(Id x, std::size_t views);
    Id parted(Id x, std::size_t views);
    Id one(const char* op, const std::vector<Id>& inputs, const Dims& dims,
           const std::map<std::string, double>& attributes = {});
    Id scaled_sum(Id a, Id b);

    Tape& tape_;
    Parameter parameter_;
};

}  // namespace splat::golden
