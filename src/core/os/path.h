#pragma once

#include <climits>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Paths and environment variables, in UTF-8.
namespace splat::os {

#if defined(_WIN32)
inline constexpr std::size_t kLongestPath = 32767;
inline constexpr char kListSeparator = ';';               ///< between paths in a variable
inline constexpr const char* kTemporaryVariable = "TMP";  ///< names temporary_place()
#else
inline constexpr std::size_t kLongestPath = PATH_MAX;
inline constexpr char kListSeparator = ':';                  ///< between paths in a variable
inline constexpr const char* kTemporaryVariable = "TMPDIR";  ///< names temporary_place()
#endif
inline constexpr std::size_t kLongestName =
    255;  ///< bytes; Windows counts in UTF-16, which are no more

/// A path of a text, and its text, with "/" everywhere. Those of the standard library use the code page on Windows.
/// Its calls do not find long ones there. With the prefix that allows them, mingw's would list other folders.
std::filesystem::path path_of(const std::string& text);
std::string text_of(const std::filesystem::path& path);

/// Where the name of a path begins: behind the last separator.
std::size_t name_start(const std::string& path);
bool is_absolute(const std::string& path);
/// "." for a name alone.
std::string folder_of(const std::string& path);

/// True if Windows takes a name for a device, whatever follows a dot in it: "NUL", "con.png". Source: Microsoft,
/// "Naming Files, Paths, and Namespaces".
bool is_device_name(std::string_view name);
/// True for what names no file on Windows: a device, or a name with a control character or one of < > : " / \ | ? *,
/// or with a dot or blank at its end, which Windows drops.
bool is_reserved_name(std::string_view name);
/// False, with EINVAL in errno, if a part of the path is a reserved name and this system is Windows.
bool may_create(const std::string& path);

/// The same text for names that are one file's: on Windows and Macs in lower case, as far as it is ASCII.
std::string one_name(const std::string& name);

/// A name beside `target` for what replaces it, of this call alone: "<target>.<process>-<number>.tmp", shortened where
/// the system does not take longer names. A killed process of the same number may have left such a file.
std::string temporary_name(const std::string& target);

/// The paths of a list as variables hold it; empty ones are left out.
std::vector<std::string> listed_paths(const std::string& text);

/// Where files lie that are of use only while a program runs: TMPDIR or /tmp, %TMP% and the like.
std::string temporary_place();

/// Value of an environment variable.
std::optional<std::string> variable(const char* name);
/// The user's folder for what can be made again: of the XDG base directory specification, or %LOCALAPPDATA%.
std::optional<std::string> cache_folder();

}  // namespace splat::os

namespace splat {

/// A name below a folder. Without these the standard library would take the text for one of the code page.
inline std::filesystem::path operator/(const std::filesystem::path& folder,
                                       const std::string& name) {
    return folder / os::path_of(name);
}
inline std::filesystem::path operator/(const std::filesystem::path& folder, const char* name) {
    return folder / os::path_of(name);
}

}  // namespace splat
