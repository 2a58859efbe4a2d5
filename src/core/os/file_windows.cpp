#include "core/os/file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <random>
#include <string_view>

#include "core/os/path.h"
#include "core/os/windows.h"

namespace splat::os {
namespace {

/// Nanoseconds since 1970 of a time in 100 ns since 1601.
std::int64_t nanoseconds(FILETIME time) {
    constexpr std::int64_t kFrom1601To1970 = 116'444'736'000'000'000;
    const std::int64_t ticks = std::int64_t{time.dwHighDateTime} << 32 | time.dwLowDateTime;
    return (ticks - kFrom1601To1970) * 100;
}

HANDLE handle_of(Handle file) {
    return reinterpret_cast<HANDLE>(file);
}

/// Others may read, write, rename and remove the file meanwhile, as elsewhere.
constexpr DWORD kShared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

HANDLE create(const std::string& path, DWORD access, DWORD how, DWORD flags) {
    return ::CreateFileW(wide_path(path).c_str(), access, kShared, nullptr, how, flags, nullptr);
}

/// Calls take less than 4 GiB.
DWORD some(std::size_t bytes) {
    return static_cast<DWORD>(std::min<std::size_t>(bytes, std::size_t{1} << 30));
}

OVERLAPPED at(std::uint64_t offset) {
    OVERLAPPED place{};
    place.Offset = static_cast<DWORD>(offset);
    place.OffsetHigh = static_cast<DWORD>(offset >> 32);
    return place;
}

bool set_end(HANDLE file, std::uint64_t bytes) {
    FILE_END_OF_FILE_INFO end{};
    end.EndOfFile.QuadPart = static_cast<LONGLONG>(bytes);
    return ::SetFileInformationByHandle(file, FileEndOfFileInfo, &end, sizeof end) != 0;
}

/// Locks keep others from reading and writing, so they are of a byte that no file has.
constexpr std::uint64_t kLockedByte = std::uint64_t{1} << 62;

/// Readers of a file that is replaced keep the old one, as elsewhere. Windows of before 2016 and some file systems
/// cannot.
bool replace(const std::string& from, const std::string& to) {
    const HANDLE file = create(from, DELETE | SYNCHRONIZE, OPEN_EXISTING,
                               FILE_FLAG_BACKUP_SEMANTICS | FILE_FLAG_OPEN_REPARSE_POINT);
    if (file == INVALID_HANDLE_VALUE) return false;
    constexpr DWORD kReplace = 1, kKeepForReaders = 2;                    // FILE_RENAME_FLAG_...
    constexpr auto kRename = static_cast<FILE_INFO_BY_HANDLE_CLASS>(22);  // FileRenameInfoEx
    const std::wstring name = wide_path(utf8(whole_path(to)));
    const std::size_t bytes = name.size() * sizeof(wchar_t);
    std::vector<std::max_align_t> memory(
        (sizeof(FILE_RENAME_INFO) + bytes) / sizeof(std::max_align_t) + 1);
    auto* const info = new (memory.data()) FILE_RENAME_INFO{};
    const DWORD flags = kReplace | kKeepForReaders;
    std::memcpy(static_cast<void*>(info), &flags, sizeof flags);  // in older headers a BOOLEAN
    info->FileNameLength = static_cast<DWORD>(bytes);
    std::memcpy(info->FileName, name.c_str(), bytes);
    const DWORD size = static_cast<DWORD>(sizeof(FILE_RENAME_INFO) + bytes);
    const bool renamed = ::SetFileInformationByHandle(file, kRename, info, size) != 0;
    ::CloseHandle(file);
    return renamed;
}

bool is_folder(const std::string& path) {
    const DWORD attributes = ::GetFileAttributesW(wide_path(path).c_str());
    return attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
}

/// Whether a path, or a part of it, is longer than names may be.
bool is_too_long(const std::string& path) {
    const std::wstring name = wide(path);
    std::size_t start = 0;
    for (std::size_t i = 0; i <= name.size(); ++i) {
        if (i < name.size() && name[i] != L'/' && name[i] != L'\\') continue;
        if (i - start > kLongestName) return true;
        start = i + 1;
    }
    return name.size() > kLongestPath;
}

/// Like fail(), where Windows tells less than others: a name that is too long is not found, a folder denies access.
int fail_at(const std::string& path) {
    fail();
    if ((errno == ENOENT || errno == EINVAL) && is_too_long(path)) errno = ENAMETOOLONG;
    if (errno == EACCES && is_folder(path)) errno = EISDIR;
    return -1;
}

/// Windows denies access to what is to be replaced while others have it open.
bool is_open_elsewhere(const std::string& path) {
    const HANDLE file =
        ::CreateFileW(wide_path(path).c_str(), DELETE, 0, nullptr, OPEN_EXISTING, 0, nullptr);
    if (file == INVALID_HANDLE_VALUE) return ::GetLastError() == ERROR_SHARING_VIOLATION;
    ::CloseHandle(file);
    return false;
}

struct CloseFind {
    void operator()(void* find) const { ::FindClose(find); }
};

}  // namespace

Handle open(const std::string& path, Open how) {
    DWORD access = GENERIC_READ | GENERIC_WRITE, creation = OPEN_EXISTING, flags = 0;
    if (how == Open::kRead) {
        access = GENERIC_READ;
        flags = FILE_FLAG_BACKUP_SEMANTICS;  // opens folders, too, to tell what they are
    }
    if (how == Open::kCreate) creation = CREATE_NEW;
    // Without FILE_WRITE_DATA each write goes to the end, wherever others have moved it.
    if (how == Open::kAppend) access = FILE_GENERIC_WRITE & ~DWORD{FILE_WRITE_DATA};
    if (how == Open::kAppend || how == Open::kUpdate) creation = OPEN_ALWAYS;
    if (creation != OPEN_EXISTING && !may_create(path)) return kNoHandle;
    const HANDLE file = create(path, access, creation, flags | FILE_ATTRIBUTE_NORMAL);
    if (file == INVALID_HANDLE_VALUE) return fail_at(path);
    return reinterpret_cast<Handle>(file);
}

int close(Handle file) {
    return ::CloseHandle(handle_of(file)) != 0 ? 0 : fail();
}

std::int64_t read(Handle file, void* to, std::size_t bytes, std::optional<std::uint64_t> offset) {
    OVERLAPPED place = at(offset.value_or(0));
    DWORD got = 0;
    if (::ReadFile(handle_of(file), to, some(bytes), &got, offset ? &place : nullptr) != 0)
        return got;
    const DWORD error = ::GetLastError();
    return error == ERROR_HANDLE_EOF || error == ERROR_BROKEN_PIPE ? 0 : fail();
}

std::int64_t write(Handle file, const void* from, std::size_t bytes,
                   std::optional<std::uint64_t> offset) {
    OVERLAPPED place = at(offset.value_or(0));
    DWORD put = 0;
    if (::WriteFile(handle_of(file), from, some(bytes), &put, offset ? &place : nullptr) != 0)
        return put;
    return fail();
}

int flush(Handle file) {
    return ::FlushFileBuffers(handle_of(file)) != 0 ? 0 : fail();
}

int resize(Handle file, std::uint64_t bytes) {
    if (set_end(handle_of(file), bytes)) return 0;
    fail();
    if (errno != EACCES) return -1;
    // A handle that appends may not.
    const HANDLE other = ::ReOpenFile(handle_of(file), GENERIC_WRITE, kShared, 0);
    if (other == INVALID_HANDLE_VALUE) return fail();
    const int result = set_end(other, bytes) ? 0 : fail();
    ::CloseHandle(other);
    return result;
}

int reserve(Handle file, std::uint64_t bytes) {
    return resize(file, bytes) == 0 ? 0 : errno;  // takes the space
}

int examine(Handle file, FileInfo& info) {
    const HANDLE handle = handle_of(file);
    BY_HANDLE_FILE_INFORMATION found{};
    const DWORD type = ::GetFileType(handle);
    info.kind = type == FILE_TYPE_PIPE ? FileKind::kPipe : FileKind::kOther;
    if (type != FILE_TYPE_DISK) return type == FILE_TYPE_UNKNOWN ? fail() : 0;
    if (::GetFileInformationByHandle(handle, &found) == 0) return fail();
    const bool folder = (found.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
    info.kind = folder ? FileKind::kFolder : FileKind::kFile;
    info.bytes = std::uint64_t{found.nFileSizeHigh} << 32 | found.nFileSizeLow;
    info.changed_ns = nanoseconds(found.ftLastWriteTime);
    info.links = found.nNumberOfLinks;
    info.number = std::uint64_t{found.nFileIndexHigh} << 32 | found.nFileIndexLow;
    return 0;
}

int examine(const std::string& path, FileInfo& info) {
    const HANDLE file =
        create(path, FILE_READ_ATTRIBUTES, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS);
    if (file == INVALID_HANDLE_VALUE) return fail_at(path);
    const int result = examine(reinterpret_cast<Handle>(file), info);
    ::CloseHandle(file);
    return result;
}

bool is_link(const std::string& path) {
    const HANDLE file = create(path, FILE_READ_ATTRIBUTES, OPEN_EXISTING,
                               FILE_FLAG_BACKUP_SEMANTICS | FILE_FLAG_OPEN_REPARSE_POINT);
    if (file == INVALID_HANDLE_VALUE) return false;
    FILE_ATTRIBUTE_TAG_INFO found{};
    const bool known =
        ::GetFileInformationByHandleEx(file, FileAttributeTagInfo, &found, sizeof found) != 0;
    ::CloseHandle(file);
    // What a cloud or a compressing disk keeps is marked, too, but is no link.
    return known && (found.FileAttributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0 &&
           (found.ReparseTag == IO_REPARSE_TAG_SYMLINK ||
            found.ReparseTag == IO_REPARSE_TAG_MOUNT_POINT);
}

bool is_own_folder(const std::string& path) {
    return is_folder(path) && !is_link(path);
}

int make_temporary_folder(std::string& path) {
    constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789";
    constexpr std::size_t kRandom = 6;
    constexpr int kMostTries = 1000;
    std::random_device random;
    for (int i = 0; i < kMostTries; ++i) {
        for (std::size_t at = path.size() - kRandom; at < path.size(); ++at)
            path[at] = kLetters[random() % kLetters.size()];
        if (::CreateDirectoryW(wide_path(path).c_str(), nullptr) != 0) return 0;
        if (::GetLastError() != ERROR_ALREADY_EXISTS) return fail();
    }
    return fail();
}

/// Files have those of their folder.
void set_permissions(Handle, int) {}

int lock(Handle file, Lock kind, bool wait) {
    OVERLAPPED place = at(kLockedByte);
    const DWORD flags = (kind == Lock::kExclusive ? LOCKFILE_EXCLUSIVE_LOCK : 0) |
                        (wait ? 0 : LOCKFILE_FAIL_IMMEDIATELY);
    return ::LockFileEx(handle_of(file), flags, 0, 1, 0, &place) != 0 ? 0 : fail();
}

void unlock(Handle file) {
    OVERLAPPED place = at(kLockedByte);
    ::UnlockFileEx(handle_of(file), 0, 1, 0, &place);
}

int rename(const std::string& from, const std::string& to) {
    if (!may_create(to)) return -1;
    constexpr DWORD kWaits = 10;  // 55 ms: who replaces or scans the file has it open as briefly
    for (DWORD wait = 1;; ++wait) {
        if (replace(from, to) ||
            ::MoveFileExW(wide_path(from).c_str(), wide_path(to).c_str(),
                          MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0)
            return 0;
        fail_at(to);
        if ((errno != EACCES && errno != EBUSY) || wait > kWaits) break;
        ::Sleep(wait);
    }
    if (errno == EACCES && is_open_elsewhere(to)) errno = EBUSY;
    return -1;
}

int remove(const std::string& path) {
    const std::wstring name = wide_path(path);
    const DWORD attributes = ::GetFileAttributesW(name.c_str());
    if (attributes == INVALID_FILE_ATTRIBUTES) return fail();
    const bool folder = (attributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
    const bool removed =
        (folder ? ::RemoveDirectoryW(name.c_str()) : ::DeleteFileW(name.c_str())) != 0;
    return removed ? 0 : fail();
}

int make_folder(const std::string& path) {
    if (!may_create(path)) return -1;
    return ::CreateDirectoryW(wide_path(path).c_str(), nullptr) != 0 ? 0 : fail_at(path);
}

/// Windows has no call for it; the disk has names within seconds.
void flush_folder_of(const std::string&) {}

Handle duplicate(Handle file) {
    const HANDLE process = ::GetCurrentProcess();
    HANDLE copy = nullptr;
    return ::DuplicateHandle(process, handle_of(file), process, &copy, 0, FALSE,
                             DUPLICATE_SAME_ACCESS) != 0
               ? reinterpret_cast<Handle>(copy)
               : fail();
}

int list(const std::string& folder, std::vector<Listed>& all) {
    WIN32_FIND_DATAW found{};
    errno = ENOENT;
    if (folder.empty()) return -1;  // "/*" is the root of the drive
    const HANDLE first = ::FindFirstFileW(wide_path(folder + "/*").c_str(), &found);
    if (first == INVALID_HANDLE_VALUE) return fail();
    const std::unique_ptr<void, CloseFind> find(first);
    do {
        Listed listed{utf8(found.cFileName), {}};
        if ((found.dwFileAttributes & FILE_ATTRIBUTE_REPARSE_POINT) == 0)
            listed.kind = (found.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0
                              ? FileKind::kFolder
                              : FileKind::kFile;
        all.push_back(std::move(listed));
    } while (::FindNextFileW(first, &found) != 0);
    return ::GetLastError() == ERROR_NO_MORE_FILES ? 0 : fail();
}

std::string reason(int number) {
    if (number == EBUSY) return "this program or another has it open; close it there";
    if (number == EACCES)
        return "access denied; it or its folder is read-only or another user's, choose another one";
    if (number == EINVAL)
        return "Windows takes no such name; choose one without < > : \" | ? *, without a dot or "
               "blank "
               "at its end, and other than CON, NUL, AUX, PRN, COM1 and LPT1";
    if (number == EWOULDBLOCK) return "another program has it locked";
    if (number == ELOOP) return "its links lead nowhere";
    return std::strerror(number);
}

}  // namespace splat::os
