#pragma once

#include <string>
#include <vector>

#include "io/tensor_file.h"
#include "model/predictor.h"

namespace splat::model {

/// What each input channel of a network means; RGB always comes first.
struct ImageChannels {
    bool depth = false;
    bool normal = false;
    bool mask = false;

    [[nodiscard]] std::uint32_t count() const;
    bool operator==(const ImageChannels&) const = default;
};

ImageChannels channels_of(const PredictorConfig& config);

struct LoadOptions {
    /// Channels that the file's network was trained with; a first convolution of fewer channels is
    /// widened, each column to where its meaning is, the new ones zero, so that the outputs stay.
    ImageChannels source;
    bool graft = false;  ///< else every tensor must be there in its shape
    /// Take over the file's ray grid although its field of view differs from the configuration's.
    bool take_rays = false;
};

/// What became of each tensor, by name.
struct LoadReport {
    std::vector<std::string> copied;
    std::vector<std::string> widened;
    std::vector<std::string> fresh;     ///< not in the file: as they were before
    std::vector<std::string> left_out;  ///< in the file only
    bool rays_differ = false;           ///< the file's ray grid is another than the configuration's
    bool rays_taken = false;
};

/// Fill a predictor from a state dict. All or nothing: on error no parameter has changed.
///
/// Parameters that the file lacks keep their values if they belong to adapters, embeddings or
/// attention to tokens, which start without effect or are to be trained; others are an error. So are,
/// without grafting, tensors that the predictor lacks, the encoder's attention to tokens, which
/// earlier versions had, among them.
///
/// Errors  kShape, naming the tensor, its shapes and what to do; kInvalidArgument for a missing
///         tensor, one that is not finite, or a ray grid of another field of view where neither
///         grafting nor take_rays was asked for
Status load_state(Predictor& predictor, const io::NamedTensors& given, const LoadOptions& options,
                  LoadReport& report);

/// Networks without offset were once saved under the names of those with one: `tensors`, or `renamed`
/// where those of a predictor without offset have such names.
Result<const io::NamedTensors*> under_own_names(const PredictorConfig& config,
                                                const io::NamedTensors& tensors,
                                                io::NamedTensors& renamed);

/// All parameters under their names, and the buffers that published files hold: ray_dirs, the
/// resampling filters and the rotation constants of spherical harmonics.
Result<io::NamedTensors> save_state(Predictor& predictor);

}  // namespace splat::model
