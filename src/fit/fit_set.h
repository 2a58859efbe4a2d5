#pragma once

#include <span>

#include "gaussians/gaussian_set.h"
#include "io/weights_file.h"

namespace splat::fit {

/// Step sizes and constants of Adam for the parameters of Gaussians.
struct Rates {
    double mean = 0;   ///< scene units
    double logit = 0;  ///< opacity
    double log_scale = 0;
    double rotation = 0;
    double constant = 0;  ///< colour, the constant term
    double rest = 0;      ///< the other harmonics
    double beta1 = 0.9, beta2 = 0.999, eps = 1e-15;
    double opacity_weight = 0, scale_weight = 0;  ///< regularisers: mean opacity and scale
    double noise = 0;         ///< factor of the covariance, by which means are moved at random
    std::uint64_t seed = 0;   ///< seed of the noise
    bool skip_zeros = false;  ///< leave quads of parameters whose gradient is 0, with their moments
};

/// What becomes of a row of a set that grows.
struct Row {
    std::uint32_t source = 0;  ///< a row of the set before
    std::uint32_t role = 0;    ///< params::kFitKeep, or another, whose moments are 0
    float logit = 0;           ///< opacity of a share
    float log_scale = 0;       ///< added to the log scales of a share
};

/// What growth goes by, of each Gaussian.
struct Score {
    float gradient = 0;  ///< mean length of its screen gradients, per view that saw it
    float opacity = 0;
};

/// Gaussians that are fitted, with their moments, in the rasterizer's layout: parameters are updated where it reads
/// them. Opacities and scales are parameters by logit and logarithm; the activated set is kept beside them.
///
/// Errors       kOutOfDeviceMemory; those of Context::run, after which the contents are undefined
/// Determinism  bit-exact for any thread count
class FitSet {
  public:
    /// Memory for `capacity` Gaussians; none is in use. Errors: kUnsupported for more than a binding of the device
    /// holds.
    static Result<FitSet> create(vk::Context& context, std::uint32_t capacity,
                                 std::uint32_t sh_degree);

    /// Begin with these, at most the capacity; bands that they lack are 0. Moments and statistics are 0.
    Status begin(const scene::Gaussians& scene);

    /// The activated set that a rasterizer draws, up to a degree.
    [[nodiscard]] gaussians::SetViews drawn(std::uint32_t sh_degree) const;
    /// Where its backward pass writes gradients of the same.
    [[nodiscard]] gaussians::SetViews gradients(std::uint32_t sh_degree) const;

    /// One step of Adam from the gradients of a call with `views` views, then noise.
    ///
    /// step         from 1
    /// exported     gradients of the projected Gaussians, of raster::Workspace
    Status update(vk::Recorder& recorder, const Rates& rates, std::uint64_t step,
                  std::uint32_t sh_degree, const vk::BufferView& exported, std::uint32_t views);

    /// Scores since the last rearrange().
    Result<std::vector<Score>> scores();

    /// Replace the rows, at most the capacity; statistics become 0. Call rearranged() once that has run.
    Status rearrange(vk::Recorder& recorder, std::span<const Row> rows);
    void rearranged(std::span<const Row> rows);

    /// The parameters as files of scenes hold them.
    Result<scene::Gaussians> scene(std::uint32_t sh_degree);

    /// Parameters, moments and statistics, by name; and back. Errors of load(): kInvalidArgument for other names or
    /// sizes.
    Status save(io::NamedTensors& tensors);
    Status load(const io::NamedTensors& tensors);

    [[nodiscard]] std::uint32_t count() const { return set_.count; }
    [[nodiscard]] const gaussians::SetDesc& desc() const { return set_.desc; }

  private:
    explicit FitSet(vk::Context& context) : context_(&context) {}

    /// An array of the state: `length` floats of each Gaussian.
    struct Array {
        const char* name;
        const vk::Buffer* buffer;
        std::uint32_t length;
        bool moments;
    };
    [[nodiscard]] std::array<Array, 6> arrays() const;
    [[nodiscard]] vk::BufferView rows_of(const vk::Buffer& buffer, std::uint32_t length,
                                         std::uint32_t rows) const;
    Status gather(vk::Recorder& recorder, std::uint32_t rows, const vk::Buffer& sources,
                  const vk::Buffer& moments, const vk::Buffer& scratch);
    Status add_noise(vk::Recorder& recorder, const Rates& rates, std::uint64_t step);
    Status split(vk::Recorder& recorder, std::uint32_t rows, const vk::Buffer& changes);
    Status activate();

    vk::Context* context_;
    gaussians::GaussianSet set_, gradients_;
    vk::Buffer raw_, m_, v_, m_colors_, v_colors_, statistics_;
    std::vector<vk::Buffer> rows_;  ///< what the recorded rearrangement reads
};

}  // namespace splat::fit
