#pragma once

#include <optional>
#include <string>

#include "core/status.h"

namespace splat {

/// Value of an environment variable, or nothing if it is unset or empty.
std::optional<std::string> environment(const char* name);

/// A number > 0 from an environment variable, or `fallback` if it is unset. Errors:
/// kInvalidArgument, names the variable.
Result<double> environment_positive(const char* name, double fallback);

/// A folder that a variable names; nothing for a relative one, which the XDG base directory specification
/// asks to ignore.
std::optional<std::string> environment_folder(const char* name);

/// `$XDG_CACHE_HOME/libsplat`, else `$HOME/.cache/libsplat`, on Windows `%LOCALAPPDATA%/libsplat`, else nothing.
std::optional<std::string> user_cache_folder();

/// The folder of the shared library that this code is in, or of the program that has it inside; empty
/// if the system does not say.
std::string library_folder();

}  // namespace splat
