#include "tables/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "core/fork.h"
#include "io/file.h"

namespace splat::tables {

Result<FileLock> FileLock::take(const std::string& path, Kind kind, const std::string& what) {
    FileLock lock;
    lock.file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock.file_ < 0) return io::system_error(errno, "create", path);
    lock.generation_ = fork_generation();
    const int operation = kind == Kind::kWait     ? LOCK_EX
                          : kind == Kind::kShared ? LOCK_SH | LOCK_NB
                                                  : LOCK_EX | LOCK_NB;
    while (::flock(lock.file_, operation) != 0) {
        if (errno == EINTR) continue;
        const int failed = errno;
        ::close(std::exchange(lock.file_, -1));
        if (failed != EWOULDBLOCK) return io::system_error(failed, "lock", path);
        return error(Code::kInvalidState,
                     "%s is in use: another process imports into it; wait for its end",
                     what.c_str());
    }
    return lock;
}

FileLock::~FileLock() {
    if (file_ < 0) return;
    // A forked child has the descriptor, too: without this the lock would last as long as the child.
    if (generation_ == fork_generation()) ::flock(file_, LOCK_UN);
    ::close(file_);
}

}  // namespace splat::tables
