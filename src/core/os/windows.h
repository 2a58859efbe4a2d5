#pragma once

#if !defined(NOMINMAX)
#define NOMINMAX
#endif
#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include <string>
#include <string_view>

/// What the files of core/os/ for Windows share.
namespace splat::os {

std::string utf8(std::wstring_view text);
/// Bytes that are no UTF-8 become U+FFFD, which no name of a file has.
std::wstring wide(std::string_view text);
/// A path from its drive or server on.
std::wstring whole_path(const std::string& path);
/// A path as the system takes it: long ones whole, with the prefix that allows them.
std::wstring wide_path(const std::string& path);

/// The file of a module, of the program for nullptr.
std::string file_of(HMODULE module);

/// Set errno to what the last error of the system means. Returns -1.
int fail();

}  // namespace splat::os
