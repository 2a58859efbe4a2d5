#pragma once

#include <span>
#include <string>

namespace vkrun {

/// Weights of Splatter Image that its authors have published.
struct PublishedWeights {
    const char* name;  ///< the name of the configuration too ('vkrun config presets')
    const char* file;
    const char* size;    ///< file size that the page of the weights gives; or "not known"
    const char* sha256;  ///< empty: not known
    const char* about;
};

inline constexpr const char* kPublishedLicence =
    "MIT by the page of the weights; the code is BSD-3-Clause, its U-Net CC BY-NC-SA 4.0 (NVIDIA)";

std::span<const PublishedWeights> published_weights();

/// Throws a Failure with the nearest name, or all.
const PublishedWeights& published_weights(const std::string& name);

/// Returns the address of the file in the authors' repository.
std::string published_address(const PublishedWeights& weights);

/// The name of the weights whose file has this hash; empty if none is known to have it.
std::string published_by_hash(const std::string& sha256);

/// Warns of LGM's published weights that are known to be wrong, by their hash. Throws a Failure for a file that cannot
/// be read.
void warn_of_old_weights(const std::string& path);

}  // namespace vkrun
