#include "core/os/file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

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
HANDLE create(const std::string& path, DWORD access, DWORD how, DWORD flags) {
    return ::CreateFileW(wide_path(path).c_str(), access,
                         FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, nullptr, how,
                         flags, nullptr);
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

/// Locks keep others from reading and writing, so they are of a byte that no file has.
constexpr std::uint64_t kLockedByte = std::uint64_t{1} << 62;

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
    if (how == Open::kAppend || how == Open::kUpdate) creation = OPEN_ALWAYS;
    const HANDLE file = create(path, access, creation, flags | FILE_ATTRIBUTE_NORMAL);
    if (file == INVALID_HANDLE_VALUE) return fail();
    if (how == Open::kAppend) ::SetFilePointerEx(file, {}, nullptr, FILE_END);
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
    return ::GetLastError() == ERROR_HANDLE_EOF ? 0 : fail();
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
    FILE_END_OF_FILE_INFO end{};
    end.EndOfFile.QuadPart = static_cast<LONGLONG>(bytes);
    return ::SetFileInformationByHandle(handle_of(file), FileEndOfFileInfo, &end, sizeof end) != 0
               ? 0
               : fail();
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
    return 0;
}

int examine(const std::string& path, FileInfo& info) {
    const HANDLE file =
        create(path, FILE_READ_ATTRIBUTES, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS);
    if (file == INVALID_HANDLE_VALUE) return fail();
    const int result = examine(reinterpret_cast<Handle>(file), info);
    ::CloseHandle(file);
    return result;
}

bool is_link(const std::string& path) {
    const DWORD attributes = ::GetFileAttributesW(wide_path(path).c_str());
    return attributes != INVALID_FILE_ATTRIBUTES &&
           (attributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0;
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
    return ::MoveFileExW(wide_path(from).c_str(), wide_path(to).c_str(),
                         MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0
               ? 0
               : fail();
}

int remove(const std::string& path) {
    return ::DeleteFileW(wide_path(path).c_str()) != 0 ? 0 : fail();
}

/// rename() waits for the disk.
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
    if (number == EBUSY) return "another program has it open";
    if (number == EWOULDBLOCK) return "another program has it locked";
    if (number == ELOOP) return "its links lead nowhere";
    return std::strerror(number);
}

}  // namespace splat::os
