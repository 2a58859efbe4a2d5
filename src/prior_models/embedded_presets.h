#pragma once

#include <span>

namespace splat::prior_models {

/// A file of presets/.
struct EmbeddedPreset {
    const char* name;  ///< name of the file, without .json
    const char* text;
};

/// Sorted by name. Defined in a file that CMake writes.
std::span<const EmbeddedPreset> embedded_presets();

}  // namespace splat::prior_models
