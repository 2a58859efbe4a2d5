#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/os/process.h"

/// What tests ask of the system beyond core/os/: `system_posix.cpp` and `system_windows.cpp`.
namespace splat::test {

#if defined(_WIN32)
inline constexpr bool kHasFork = false;
inline constexpr bool kHasFileLimit = false;
inline constexpr bool kHasPermissions = false;
inline constexpr bool kWritesMapped = false;
inline constexpr const char* kOddName = "a[1] b";  ///< with letters that patterns of names have
inline constexpr const char* kSomeLibrary = "msvcrt.dll";  ///< the loader finds it
#else
inline constexpr bool kHasFork = true;
inline constexpr bool kHasFileLimit = true;
inline constexpr bool kHasPermissions = true;
inline constexpr bool kWritesMapped = true;
inline constexpr const char* kOddName = "a[1] b?c*";
inline constexpr const char* kSomeLibrary = "libz.so.1";
#endif

/// Tests that need what this system lacks begin with one of these, so that they are skipped visibly.
#define SPLAT_NEED_FORK() \
    if (!splat::test::kHasFork) GTEST_SKIP() << "processes of this system do not fork"
#define SPLAT_NEED_FILE_LIMIT() \
    if (!splat::test::kHasFileLimit) GTEST_SKIP() << "this system does not limit sizes of files"
#define SPLAT_NEED_PERMISSIONS() \
    if (!splat::test::kHasPermissions) GTEST_SKIP() << "files of this system have no permissions"
#define SPLAT_NEED_WRITES_TO_MAPPED_FILES() \
    if (!splat::test::kWritesMapped)        \
    GTEST_SKIP() << "this system keeps files that are mapped as they are"
#define SPLAT_NEED_FIFO(path) \
    if (!splat::test::make_fifo(path)) GTEST_SKIP() << "folders of this system hold no pipes"
#define SPLAT_NEED_LINKS(folder)              \
    if (!splat::test::makes_links_in(folder)) \
    GTEST_SKIP() << "this user may not make symbolic links on this system"

void set_variable(const std::string& name, const std::string& value);
void unset_variable(const std::string& name);

/// The number of this process as text, for names that no other process takes.
inline std::string process_text() {
    return std::to_string(os::process_id());
}

/// A pipe with a name; false where the system has none.
bool make_fifo(const std::string& path);
/// Whether this user may make a symbolic link in a folder. Leaves the folder as it was.
bool makes_links_in(const std::string& folder);
/// Whether permissions do not hold for this user.
bool is_root();

/// While it lives, no file of this process grows beyond these bytes; a write that would fails.
class FileLimit {
  public:
    explicit FileLimit(std::uint64_t bytes);
    FileLimit(const FileLimit&) = delete;
    FileLimit& operator=(const FileLimit&) = delete;
    ~FileLimit();

  private:
    std::uint64_t before_ = 0;
    void (*handler_)(int) = nullptr;
};

/// While it lives, this process is not root, who reads everything.
class AnotherUser {
  public:
    AnotherUser();
    AnotherUser(const AnotherUser&) = delete;
    AnotherUser& operator=(const AnotherUser&) = delete;
    ~AnotherUser();

  private:
    bool was_root_ = false;
};

/// While it lives, the system starts no thread for this process, if it has such a limit. It does not hold for root, so
/// that another user runs the process meanwhile.
class NoMoreThreads {
  public:
    NoMoreThreads();
    NoMoreThreads(const NoMoreThreads&) = delete;
    NoMoreThreads& operator=(const NoMoreThreads&) = delete;
    ~NoMoreThreads();
    [[nodiscard]] bool works() const;

  private:
    bool was_root_ = false;
    std::uint64_t before_ = 0;
};

/// A forked child that ends with the number that `body` returns. Nothing where processes do not fork.
class Child {
  public:
    explicit Child(const std::function<int()>& body);
    /// Returns the exit status; minus the number of the signal that ended it.
    int wait() const;

  private:
    std::int64_t process_ = -1;
};
/// The system ends this process after some seconds; only for a forked child.
void end_after(unsigned seconds);
inline int in_child(const std::function<int()>& body) {
    return Child(body).wait();
}

/// What this process has taken so far: the most memory at one time, and seconds of the processor.
std::uint64_t peak_bytes();
double processor_seconds();

}  // namespace splat::test
