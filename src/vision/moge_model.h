#pragma once

#include <memory>

#include "io/tensor_file.h"
#include "nn/executor.h"
#include "vision/moge_net.h"

namespace splat::vision {

/// What MoGe-2 makes of a picture, each of its size, row by row.
struct MogeMaps {
    std::vector<float>
        points;  ///< [height,width,3], x right, y down, z forward, up to a shift of z and the scale
    std::vector<float>
        normals;  ///< [height,width,3], unit, in the same axes; empty if the network makes none
    std::vector<float> mask;  ///< [height,width], 0 to 1: where points are valid
    float scale = 1;          ///< metres per unit of the points, once they are shifted
};

/// MoGe-2 (Wang et al. 2025, arXiv:2507.02546), as the published code runs it in PyTorch: the picture is resampled
/// bilinearly with antialiasing to whole patches, positions by DINOv2's factors, results bilinearly to the picture's
/// size, and then remapped:  z = exp z', (x, y) = (x', y') z;  mask sigmoid;  scale exp.
///
/// Not thread-safe, as vk::Context.
class MogeModel {
  public:
    static constexpr std::int64_t kBalanced = 2;

    /// Check all tensors, without the device; load() comes next. precision: of convolutions, see conv2d. Errors: those
    /// of moge_sizes() and check_tensors().
    static Result<std::unique_ptr<MogeModel>> create(vk::Context& context,
                                                     const io::NamedTensors& tensors,
                                                     const MogeConfig& config,
                                                     std::int64_t precision = kBalanced);

    /// Put the weights on the device. `tensors`: those of create(). Errors: kOutOfDeviceMemory.
    Status load(const io::NamedTensors& tensors);

    [[nodiscard]] const MogeSizes& sizes() const { return sizes_; }
    [[nodiscard]] bool makes_normals() const { return sizes_.heads.size() == 3; }

    /// Maps of a picture [3,height,width] of RGB from 0 to 1, seen by about `tokens` patches: rounded numbers of rows
    /// and columns in the picture's aspect.
    ///
    /// Errors  kInvalidArgument for sides of 0, and tokens that make a side of 0 or more than kMostTokens patches;
    ///         kOutOfDeviceMemory, naming the tokens, before anything is allocated
    Result<MogeMaps> run(std::span<const float> image, std::uint32_t width, std::uint32_t height,
                         std::int64_t tokens);
    static constexpr std::int64_t kMostTokens = 65535;  ///< attention() has 65536 keys at most

    /// Features [features,rows,columns] and class token [width] of the latest run, for tests.
    Result<std::vector<float>> features();
    Result<std::vector<float>> class_token();

  private:
    MogeModel(vk::Context& context, MogeSizes sizes, std::int64_t precision)
        : context_(context), sizes_(std::move(sizes)), precision_(precision) {}
    Status check(const io::NamedTensors& tensors);
    Status prepare(std::uint32_t rows, std::uint32_t columns);
    Status put_inputs(std::span<const float> image, std::uint32_t width, std::uint32_t height);
    Result<std::vector<float>> take(nn::ValueId value);

    vk::Context& context_;
    MogeSizes sizes_;
    std::int64_t precision_;
    std::unique_ptr<nn::Graph> first_graph_;  ///< graph that the parameters were made for
    std::map<std::string, Origin> origins_;   ///< where each parameter comes from
    std::unique_ptr<nn::Parameters> parameters_;
    std::vector<float> positions_, first_token_;  ///< [width,side,side], [width]
    std::vector<float> mean_, deviation_;         ///< by channel
    std::uint32_t rows_ = 0, columns_ = 0;        ///< size of the graph
    std::unique_ptr<nn::Graph> graph_;
    MogeValues values_;
    std::unique_ptr<nn::Executor> executor_;
};

}  // namespace splat::vision
