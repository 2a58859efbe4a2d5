#include "tables/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "core/fork.h"
#include "io/file.h"

namespace splat::tables {

Result<FileLock> lock_file(const std::string& path, int operation, const std::string& what) {
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (file < 0) return io::system_error(errno, "create", path);
    // A forked child has the descriptor, too: without LOCK_UN the lock would last as long as the child.
    FileLock lock(nullptr, [file, generation = fork_generation()](void*) {
        if (generation == fork_generation()) ::flock(file, LOCK_UN);
        ::close(file);
    });
    while (::flock(file, operation) != 0) {
        if (errno == EWOULDBLOCK)
            return bad_state("%s is in use: another process imports into it; wait for its end",
                             what.c_str());
        if (errno != EINTR) return io::system_error(errno, "lock", path);
    }
    return lock;
}

}  // namespace splat::tables
