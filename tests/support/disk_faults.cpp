// Writes fail as on a bad disk. Preloaded into vkrun, or linked into a test, it takes the place of the system's
// calls for the files below a folder. DISK_FAULTS=KIND:N:FOLDER, where KIND is
//
//   rough   of two calls one is interrupted by a signal, the other writes at most half of the bytes
//   full    the N-th call that writes, counted from 1, writes half of the bytes; there is no space for later ones
//   error   the N-th call that writes or flushes fails, only this one

#include <fcntl.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>

namespace {

enum class Kind { kNone, kRough, kFull, kError };

struct Faults {
    Kind kind = Kind::kNone;
    long n = 0;
    std::string folder;
};

/// Read at each call: a test may change it between two of them.
Faults faults() {
    const char* const text = std::getenv("DISK_FAULTS");
    const char* const first = text == nullptr ? nullptr : std::strchr(text, ':');
    const char* const second = first == nullptr ? nullptr : std::strchr(first + 1, ':');
    if (second == nullptr) return {};
    const Kind kind = *text == 'r' ? Kind::kRough : *text == 'f' ? Kind::kFull : Kind::kError;
    return {kind, std::atol(first + 1), second + 1};
}

/// Calls since DISK_FAULTS changed, with this one.
long count_call() {
    static std::mutex mutex;
    static std::string last;
    static long calls = 0;
    const std::lock_guard lock(mutex);
    const char* const text = std::getenv("DISK_FAULTS");
    if (last != text) calls = 0;
    last = text;
    return ++calls;
}

bool lies_in(int file, const std::string& folder) {
    char link[64], path[4096];
    std::snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    const ssize_t length = ::readlink(link, path, sizeof path - 1);
    if (length < 0) return false;
    path[length] = 0;
    return std::strncmp(path, folder.c_str(), folder.size()) == 0;
}

/// How many of `bytes` this call takes; -1 with errno set if it fails.
ssize_t taken(int file, std::size_t bytes, bool writes) {
    const Faults now = faults();
    const auto all = static_cast<ssize_t>(bytes);
    if (now.kind == Kind::kNone || !lies_in(file, now.folder)) return all;
    const auto fail = [](int reason) {
        errno = reason;
        return ssize_t{-1};
    };
    if (now.kind == Kind::kFull && !writes) return all;
    const long call = count_call();
    if (now.kind == Kind::kRough && call % 2 == 1) return fail(EINTR);
    if (now.kind == Kind::kError && call == now.n) return fail(EIO);
    if (now.kind == Kind::kFull && call > now.n) return fail(ENOSPC);
    const bool half = now.kind == Kind::kRough || (now.kind == Kind::kFull && call == now.n);
    return half ? std::max<ssize_t>(all / 2, std::min<ssize_t>(all, 1)) : all;
}

}  // namespace

extern "C" {

__attribute__((visibility("default"))) ssize_t write(int file, const void* from, size_t bytes) {
    const ssize_t count = taken(file, bytes, true);
    return count < 0 ? count : syscall(SYS_write, file, from, count);
}

__attribute__((visibility("default"))) ssize_t pwrite(int file, const void* from, size_t bytes,
                                                      off_t at) {
    const ssize_t count = taken(file, bytes, true);
    return count < 0 ? count : syscall(SYS_pwrite64, file, from, count, at);
}

__attribute__((visibility("default"))) ssize_t pwrite64(int file, const void* from, size_t bytes,
                                                        off64_t at) {
    return pwrite(file, from, bytes, at);
}

/// A writer must go on after a part, too.
__attribute__((visibility("default"))) ssize_t writev(int file, const iovec* parts, int count) {
    for (int i = 0; i < count; ++i)
        if (parts[i].iov_len > 0) return write(file, parts[i].iov_base, parts[i].iov_len);
    return 0;
}

__attribute__((visibility("default"))) int fsync(int file) {
    return taken(file, 0, false) < 0 ? -1 : static_cast<int>(syscall(SYS_fsync, file));
}
}
