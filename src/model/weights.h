#pragma once

#include <string>
#include <vector>

#include "io/tensor_file.h"
#include "model/model.h"

namespace splat::model {

/// The meaning of a network's input channels; RGB always comes first.
struct ImageChannels {
    bool depth = false;
    bool normal = false;
    bool mask = false;
    bool plane = false;  ///< five channels

    [[nodiscard]] std::uint32_t count() const;
    bool operator==(const ImageChannels&) const = default;
};

ImageChannels channels_of(const ModelConfig& config);

struct LoadOptions {
    /// Channels that the file's network was trained with. A first convolution of fewer channels is widened:
    /// each column moves to the channel of its meaning, new ones are zero, so that the outputs stay.
    ImageChannels source;
    bool graft = false;  ///< false: every tensor must exist in its shape
    /// Use the file's ray grid although its field of view differs from the configuration's.
    bool take_rays = false;
};

/// What happened to each tensor, by name.
struct LoadReport {
    std::vector<std::string> copied;
    std::vector<std::string> widened;
    std::vector<std::string> fresh;     ///< not in the file: unchanged
    std::vector<std::string> left_out;  ///< only in the file
    bool rays_differ = false;           ///< the file's ray grid differs from the configuration's
    bool rays_taken = false;
};

/// Fill a model from a state dict. All or nothing: on error no parameter has changed.
///
/// Parameters that the file lacks keep their values if they belong to adapters, embeddings or attention to
/// tokens, which start without effect or are to be trained; others are an error. Without grafting, tensors
/// that the model lacks are also an error, such as the encoder's attention to tokens of earlier
/// versions.
///
/// Errors  kShape, naming the tensor, its shapes and what to do; kInvalidArgument for a missing
///         tensor, one that is not finite, or a ray grid of another field of view without
///         grafting or take_rays
Status load_state(Model& model, const io::NamedTensors& given, const LoadOptions& options,
                  LoadReport& report);

/// Checks names and shapes for load_state(), before the network takes memory. Errors: kFormat where load_state() has
/// kInvalidArgument; kShape; those of a configuration.
Status check_state(vk::Context& context, const ModelConfig& config, const io::NamedTensors& given,
                   const LoadOptions& options);

/// The channels of a file's network, where nobody names them: those of the configuration if the first
/// convolution has as many, else RGB alone.
ImageChannels likely_channels(const ModelConfig& config, const io::NamedTensors& tensors);

/// Earlier versions saved networks without offset under the names of those with one. Returns `tensors`, or
/// `renamed` if the model has no offset and the tensors have such names.
Result<const io::NamedTensors*> under_own_names(const ModelConfig& config,
                                                const io::NamedTensors& tensors,
                                                io::NamedTensors& renamed);

/// All parameters under their names, and the buffers of published files: ray_dirs, the resampling filters
/// and the rotation constants of spherical harmonics.
Result<io::NamedTensors> save_state(Model& model);

}  // namespace splat::model
