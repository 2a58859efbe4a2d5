#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "nn/graph.h"

namespace splat::vision {

/// What of a file's tensor a parameter of the graph is.
enum class Form {
    kSame,        ///< the same numbers
    kThird,       ///< one of three equal parts of the rows
    kTransposed,  ///< weights of a transposed convolution, [C,K,s,s]: [K*s*s,C,1,1]
    kRepeated,    ///< each number as often as the kernel of a transposed convolution has places
    /// Weights of a 3x3 convolution of an image made twice as large bilinearly, as those of one of the image itself:
    /// [K,C,3,3] to [4K,C,3,3], whose channels are patches of 2 x 2. Borders are repeated in both.
    kOfTwice,
};

/// A tensor of the file.
struct Source {
    std::string name;
    std::vector<std::int64_t> dims;
};

/// Products of matrices, of which the last may have further axes, and their sum: layers with nothing but sums between
/// them are one layer.
using Product = std::vector<Source>;
using Sum = std::vector<Product>;

/// Where a parameter's values come from.
struct Origin {
    std::string tensor = {};              ///< name in the file
    std::vector<std::int64_t> dims = {};  ///< shape there
    Form form = Form::kSame;
    std::uint32_t number = 0;  ///< kThird: which one; kRepeated: how often
    std::string rows_by =
        {};        ///< name of a tensor, one number a row, that multiplies the rows; empty: none
    Sum sum = {};  ///< instead of one tensor, with kSame or kOfTwice
};

/// Layers of a network whose weights are given: each adds operators to a graph, and notes what its parameters are in a
/// file. Values are images [1,C,H,W]; after an error in the graph nothing is added.
class Layers {
  public:
    /// precision: of convolutions, see conv2d
    Layers(nn::Graph& graph, std::int64_t precision) : graph_(graph), precision_(precision) {}

    /// A linear layer of each pixel, [out,in] in the file, plus `residual`. `rows_by` names a layer scale, which
    /// multiplies the layer's output before the sum.
    nn::ValueId linear(const std::string& name, nn::ValueId x, std::uint32_t out,
                       nn::ValueId residual = nn::kNoValue, const std::string& rows_by = {});

    /// The third of a linear layer [3C,C] of each pixel.
    nn::ValueId third(const std::string& name, nn::ValueId x, std::uint32_t number);

    /// A convolution, [out,in,kernel,kernel] in the file, plus `residual`; kernel 1.
    nn::ValueId conv1(const std::string& name, nn::ValueId x, std::uint32_t out,
                      nn::ValueId residual = nn::kNoValue);
    /// The same with a kernel of 3 and a border that repeats the image's.
    nn::ValueId conv3(const std::string& name, nn::ValueId x, std::uint32_t out,
                      nn::ValueId residual = nn::kNoValue);

    /// Like conv1, with sums of the file's tensors.
    nn::ValueId conv1_of(const std::string& name, nn::ValueId x, std::uint32_t out,
                         const Sum& weight, const Sum& bias, nn::ValueId residual);
    /// conv3 of x made twice as large bilinearly, by the sum [out,in,3,3] without a bias: patches of 2 x 2 as channels,
    /// plus `residual`, which has such channels.
    nn::ValueId conv3_of_twice(const std::string& name, nn::ValueId x, std::uint32_t out,
                               const Sum& weight, nn::ValueId residual = nn::kNoValue);

    /// A convolution whose kernel and stride are `size`, plus `residual`: one pixel for each patch.
    nn::ValueId patches(const std::string& name, nn::ValueId x, std::uint32_t out,
                        std::uint32_t size, nn::ValueId residual);

    /// A transposed convolution whose kernel and stride are 2, [in,out,2,2] in the file.
    nn::ValueId transposed(const std::string& name, nn::ValueId x, std::uint32_t out);

    /// Over the channels of each pixel.
    nn::ValueId layer_norm(const std::string& name, nn::ValueId x, double eps);
    /// Over all pixels of each group of channels.
    nn::ValueId group_norm(const std::string& name, nn::ValueId x, std::uint32_t groups,
                           double eps);

    /// Border pixels of 0 added or, where negative, taken off, on both sides and at top and bottom.
    struct Pad {
        std::int64_t left = 0, right = 0, top = 0, bottom = 0;
    };
    nn::ValueId pad(nn::ValueId x, const Pad& pad);

    [[nodiscard]] nn::Graph& graph() { return graph_; }
    [[nodiscard]] bool ok() const { return graph_.status().ok(); }
    [[nodiscard]] std::uint32_t channels(nn::ValueId x) const { return graph_.value(x).shape[1]; }

    /// By name of the parameter.
    [[nodiscard]] const std::map<std::string, Origin>& origins() const { return origins_; }

  private:
    nn::ValueId parameter(const std::string& name, const Shape& shape, Origin origin);
    nn::ValueId convolve(nn::ValueId x, nn::ValueId weight, nn::ValueId bias, nn::ValueId residual,
                         bool replicate = false);

    nn::Graph& graph_;
    std::int64_t precision_;
    std::map<std::string, Origin> origins_;
};

}  // namespace splat::vision
