#include "core/os/library.h"

#include "core/os/windows.h"

namespace splat::os {

std::string library_file(const std::string& name) {
    return name + ".dll";
}

void* load_library(const std::string& path, std::string& failed, bool) {
    const bool file = path.find_first_of("/\\") != std::string::npos;
    // What a library needs lies beside it. The current folder is never searched.
    const DWORD flags =
        LOAD_LIBRARY_SEARCH_DEFAULT_DIRS | (file ? LOAD_LIBRARY_SEARCH_DLL_LOAD_DIR : 0);
    const std::wstring name = file ? whole_path(path) : wide(path);
    const HMODULE library = ::LoadLibraryExW(name.c_str(), nullptr, flags);
    if (library != nullptr) return library;
    const DWORD number = ::GetLastError();
    wchar_t text[300];
    DWORD units = ::FormatMessageW(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS,
                                   nullptr, number, 0, text, 300, nullptr);
    while (units > 0 && text[units - 1] <= L'.') --units;  // the end of a line and a stop
    failed = path + ": " +
             (units > 0 ? utf8({text, units}) : "the system's error " + std::to_string(number));
    return nullptr;
}

void* function_of(void* library, const char* name) {
    return reinterpret_cast<void*>(::GetProcAddress(static_cast<HMODULE>(library), name));
}

std::string file_of_code() {
    HMODULE module = nullptr;
    if (::GetModuleHandleExW(
            GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
            reinterpret_cast<const wchar_t*>(&file_of_code), &module) == 0)
        return "";
    return file_of(module);
}

}  // namespace splat::os
