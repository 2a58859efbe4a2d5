#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/status.h"

namespace splat::config {

/// A configuration that the library has by name: a file of presets/.
struct Preset {
    std::string_view name;  ///< "cars"
    std::string_view text;  ///< YAML; its first line is a comment that says what it is
};

/// In the order of their names.
std::span<const Preset> presets();

/// Errors: kInvalidArgument, with all names, for another one.
Result<Preset> preset_of(std::string_view name);

/// JSON: [{"name", "about"}].
std::string presets_json();

}  // namespace splat::config
