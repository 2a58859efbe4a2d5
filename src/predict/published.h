#pragma once

#include <string>
#include <utility>
#include <vector>

#include "config/model_config.h"
#include "core/json_writer.h"
#include "core/status.h"
#include "io/tensor_file.h"

namespace splat::predict {

/// What names and shapes of a network's tensors tell: keys of configurations, and their values as text.
using Traits = std::vector<std::pair<std::string, std::string>>;

/// Empty if there is no network among the tensors.
Traits traits_of(const io::NamedTensors& tensors);
Traits traits_of(const config::ModelConfig& config);

/// The published configurations (config/presets.h) that weights without a configuration may be for.
struct PublishedFit {
    std::vector<std::string> names;  ///< fitting configurations; only the first stage of a training
    std::string head;                ///< name of their head
    std::string nearest;             ///< if none fits; empty if there is no network
    std::string look;                ///< if there is no network: "MoGe-2"
    std::vector<std::string> differences;  ///< from it: "model.base_dim is 32 (there 128)"

    /// "its tensors fit the published configurations cars, chairs"
    [[nodiscard]] std::string sentence() const;
    /// {"fit", "head", "nearest", "differences", "sentence"}
    void write(JsonWriter& json) const;
};

/// By traits and the field of view of ray_dirs; where several are left, by the published name of the file at
/// `path`: model_NAME, or model_latest for objaverse.
PublishedFit published_fit(const io::NamedTensors& tensors, const std::string& path);

/// Errors: kInvalidArgument, with what the weights look like, for those of another network, of LGM in other sizes, and
/// of a published one whose head is not the configuration's.
Status expect_network(const io::NamedTensors& tensors, const config::ModelConfig& config);

}  // namespace splat::predict
