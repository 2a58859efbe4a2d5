#include "tables/file_lock.h"

#include <cerrno>

#include "core/fork.h"
#include "io/file.h"

namespace splat::tables {

Result<FileLock> lock_file(const std::string& path, os::Lock kind, bool wait,
                           const std::string& what) {
    const os::Handle file = os::open(path, os::Open::kUpdate);
    if (file == os::kNoHandle) return io::system_error(errno, "create", path);
    // A forked child has the handle, too: without this the lock would last as long as the child.
    FileLock lock(nullptr, [file, generation = fork_generation()](void*) {
        if (generation == fork_generation()) os::unlock(file);
        os::close(file);
    });
    while (os::lock(file, kind, wait) != 0) {
        if (errno == EWOULDBLOCK)
            return bad_state("%s is in use: another process imports into it; wait for its end",
                             what.c_str());
        if (errno != EINTR) return io::system_error(errno, "lock", path);
    }
    return lock;
}

}  // namespace splat::tables
