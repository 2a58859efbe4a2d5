#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// Files as the system has them. Paths are UTF-8. A call that fails returns -1 and sets errno, on Windows too.
namespace splat::os {

#if defined(_WIN32)
using Handle = std::intptr_t;  ///< a HANDLE
#else
using Handle = int;  ///< a file descriptor
#endif
inline constexpr Handle kNoHandle = -1;

enum class Open {
    kRead,       ///< what is there
    kCreate,     ///< a new file, to write
    kAppend,     ///< a new or old file, to write at its end
    kUpdate,     ///< a new or old file, to read and write
    kUpdateOld,  ///< an old file, to read and write
};

/// No child inherits the handle, and a pipe of that name is not waited for.
Handle open(const std::string& path, Open how);
int close(Handle file);

/// Read or write some bytes: at an offset, or where the file stands. Returns how many; 0 read: the end.
std::int64_t read(Handle file, void* to, std::size_t bytes, std::optional<std::uint64_t> offset);
std::int64_t write(Handle file, const void* from, std::size_t bytes,
                   std::optional<std::uint64_t> offset);

/// Wait until the disk has all of it.
int flush(Handle file);
int resize(Handle file, std::uint64_t bytes);
/// Take disk space for this many bytes. Returns an error number; 0 also where the file system cannot.
int reserve(Handle file, std::uint64_t bytes);

enum class FileKind { kFile, kFolder, kPipe, kOther };

struct FileInfo {
    FileKind kind = FileKind::kOther;
    std::uint64_t bytes = 0;
    std::int64_t changed_ns = 0;  ///< last change of its contents, since 1970
    int permissions = 0;
    std::uint64_t links = 0;   ///< names of the file; 0: removed
    std::uint64_t number = 0;  ///< what tells it from others of its disk
};

int examine(Handle file, FileInfo& info);
/// Follows symbolic links.
int examine(const std::string& path, FileInfo& info);
bool is_link(const std::string& path);
/// A folder, no link to one, that belongs to this user; on Windows, where the place of temporary folders is the user's
/// own, any folder.
bool is_own_folder(const std::string& path);
/// Makes a folder that only this user may enter, with a new name that replaces the "XXXXXX" at the end of `path`.
int make_temporary_folder(std::string& path);
/// Does nothing where the file system has no permissions.
void set_permissions(Handle file, int permissions);

/// A lock of the whole file against other handles, which ends when its handle is closed. Forked children share the
/// handle. Sets errno to EWOULDBLOCK if another one has it and this call does not `wait`.
enum class Lock { kShared, kExclusive };
int lock(Handle file, Lock kind, bool wait);
void unlock(Handle file);

/// Give a file another name, whose old file is replaced at once.
int rename(const std::string& from, const std::string& to);
/// Remove a file or an empty folder.
int remove(const std::string& path);
/// In a folder that is there.
int make_folder(const std::string& path);
/// Make a folder unless it is there, and those that it lies in (`file.cpp`).
int make_folders(const std::string& path);
/// Flush the names in the folder of `path` to the disk. Some systems cannot; the files are complete anyway.
void flush_folder_of(const std::string& path);
/// Another handle of the same file, which no child inherits.
Handle duplicate(Handle file);

struct Listed {
    std::string name;
    std::optional<FileKind> kind;  ///< a file or a folder; nothing: look at it
};
int list(const std::string& folder, std::vector<Listed>& all);

/// What an error number means.
std::string reason(int number);

}  // namespace splat::os
