#pragma once

#include <string>

/// Libraries that are loaded while the program runs. They are never closed: their threads and static objects are not
/// made for it.
namespace splat::os {

/// The file of a library: "libname.so", "name.dll", "libname.dylib".
std::string library_file(const std::string& name);

/// nullptr, with the reason in `failed`. A bare name is sought where the system looks for libraries.
/// `lazily`: functions that the library lacks are an error when they are called, if the system can wait until then.
void* load_library(const std::string& path, std::string& failed, bool lazily = false);

/// nullptr if the library has no such function.
void* function_of(void* library, const char* name);

/// The file that this code is in; empty if the system does not say.
std::string file_of_code();

}  // namespace splat::os
