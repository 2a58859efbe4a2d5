#include "core/os/windows.h"

#include <cerrno>

#include "core/os/path.h"

namespace splat::os {
namespace {

/// Longer ones need a prefix: 260 units less the name of a file of 8 + 3 in a folder, and the end.
constexpr std::size_t kLongestPlain = 247;

struct Meaning {
    DWORD system;
    int number;
};
constexpr Meaning kMeanings[] = {
    {ERROR_FILE_NOT_FOUND, ENOENT},       {ERROR_PATH_NOT_FOUND, ENOENT},
    {ERROR_INVALID_DRIVE, ENOENT},        {ERROR_BAD_NETPATH, ENOENT},
    {ERROR_BAD_NET_NAME, ENOENT},         {ERROR_INVALID_NAME, EINVAL},
    {ERROR_DIRECTORY, ENOTDIR},           {ERROR_ACCESS_DENIED, EACCES},
    {ERROR_WRITE_PROTECT, EROFS},         {ERROR_SHARING_VIOLATION, EBUSY},
    {ERROR_USER_MAPPED_FILE, EBUSY},      {ERROR_LOCK_VIOLATION, EWOULDBLOCK},
    {ERROR_IO_PENDING, EWOULDBLOCK},      {ERROR_FILE_EXISTS, EEXIST},
    {ERROR_ALREADY_EXISTS, EEXIST},       {ERROR_DISK_FULL, ENOSPC},
    {ERROR_HANDLE_DISK_FULL, ENOSPC},     {ERROR_NOT_ENOUGH_MEMORY, ENOMEM},
    {ERROR_OUTOFMEMORY, ENOMEM},          {ERROR_TOO_MANY_OPEN_FILES, EMFILE},
    {ERROR_INVALID_HANDLE, EBADF},        {ERROR_DIR_NOT_EMPTY, ENOTEMPTY},
    {ERROR_NOT_SAME_DEVICE, EXDEV},       {ERROR_FILENAME_EXCED_RANGE, ENAMETOOLONG},
    {ERROR_CANT_RESOLVE_FILENAME, ELOOP}, {ERROR_BAD_PATHNAME, ENOENT},
    {ERROR_BROKEN_PIPE, EPIPE},           {ERROR_NO_DATA, EPIPE},
    {ERROR_COMMITMENT_LIMIT, ENOMEM},     {ERROR_NO_SYSTEM_RESOURCES, ENOMEM}};

}  // namespace

std::string utf8(std::wstring_view text) {
    const int units = static_cast<int>(text.size());
    const int bytes =
        ::WideCharToMultiByte(CP_UTF8, 0, text.data(), units, nullptr, 0, nullptr, nullptr);
    std::string found(static_cast<std::size_t>(bytes), '\0');
    ::WideCharToMultiByte(CP_UTF8, 0, text.data(), units, found.data(), bytes, nullptr, nullptr);
    return found;
}

std::wstring wide(std::string_view text) {
    const int bytes = static_cast<int>(text.size());
    const int units = ::MultiByteToWideChar(CP_UTF8, 0, text.data(), bytes, nullptr, 0);
    std::wstring found(static_cast<std::size_t>(units), L'\0');
    ::MultiByteToWideChar(CP_UTF8, 0, text.data(), bytes, found.data(), units);
    return found;
}

std::wstring whole_path(const std::string& path) {
    const std::wstring given = wide(path);
    const DWORD units = ::GetFullPathNameW(given.c_str(), 0, nullptr, nullptr);
    std::wstring whole(units, L'\0');
    whole.resize(::GetFullPathNameW(given.c_str(), units, whole.data(), nullptr));
    return whole;
}

std::wstring wide_path(const std::string& path) {
    const std::wstring whole = whole_path(path);
    if (whole.size() <= kLongestPlain) return wide(path);
    if (whole.starts_with(LR"(\\?\)")) return whole;
    if (whole.starts_with(LR"(\\)")) return LR"(\\?\UNC)" + whole.substr(1);
    return LR"(\\?\)" + whole;
}

std::string file_of(HMODULE module) {
    std::wstring path(kLongestPath + 1, L'\0');
    path.resize(::GetModuleFileNameW(module, path.data(), static_cast<DWORD>(path.size())));
    return utf8(path);
}

int fail() {
    const DWORD last = ::GetLastError();
    errno = EIO;
    for (const Meaning& meaning : kMeanings)
        if (meaning.system == last) errno = meaning.number;
    return -1;
}

}  // namespace splat::os
