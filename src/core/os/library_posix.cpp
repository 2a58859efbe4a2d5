#include "core/os/library.h"

#include <dlfcn.h>

namespace splat::os {

std::string library_file(const std::string& name) {
#if defined(__APPLE__)
    return "lib" + name + ".dylib";
#else
    return "lib" + name + ".so";
#endif
}

void* load_library(const std::string& path, std::string& failed, bool lazily) {
    void* const library = ::dlopen(path.c_str(), (lazily ? RTLD_LAZY : RTLD_NOW) | RTLD_LOCAL);
    if (library != nullptr) return library;
    const char* const text = ::dlerror();
    failed = text == nullptr ? "unknown reason" : text;
    return nullptr;
}

void* function_of(void* library, const char* name) {
    return ::dlsym(library, name);
}

std::string file_of_code() {
    Dl_info info{};
    if (::dladdr(reinterpret_cast<const void*>(&file_of_code), &info) == 0) return "";
    return info.dli_fname == nullptr ? "" : info.dli_fname;
}

}  // namespace splat::os
