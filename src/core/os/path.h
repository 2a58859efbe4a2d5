#pragma once

#include <climits>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

/// Paths and environment variables, in UTF-8.
namespace splat::os {

#if defined(_WIN32)
inline constexpr std::size_t kLongestPath = 32767;
#else
inline constexpr std::size_t kLongestPath = PATH_MAX;
#endif
inline constexpr std::size_t kLongestName =
    255;  ///< bytes; Windows counts in UTF-16, which are no more

/// A path of a text, and its text, with "/" everywhere. Those of the standard library use the code page on Windows.
std::filesystem::path path_of(const std::string& text);
std::string text_of(const std::filesystem::path& path);

/// Where the name of a path begins: behind the last separator.
std::size_t name_start(const std::string& path);
bool is_absolute(const std::string& path);
/// "." for a name alone.
std::string folder_of(const std::string& path);

/// A name beside `target` for what replaces it, of this call alone: "<target>.<process>-<number>.tmp", shortened where
/// the system does not take longer names. A killed process of the same number may have left such a file.
std::string temporary_name(const std::string& target);

/// Value of an environment variable.
std::optional<std::string> variable(const char* name);
/// The user's folder for what can be made again: of the XDG base directory specification, or %LOCALAPPDATA%.
std::optional<std::string> cache_folder();

}  // namespace splat::os
