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

/// Hash of LGM's model_fp16.safetensors from before its correction: its quaternions were normalised along the wrong
/// axis while it was trained, so that rotations are wrong here. The file of the name ..._fixrot is the right one.
inline constexpr const char* kLgmBeforeFix =
    "5a7ab3128a73dce6d2927d5c7c7ec79a7f7ca885fec960db86d991f272fe2e9d";

}  // namespace vkrun
