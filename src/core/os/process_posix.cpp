#include "core/os/process.h"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>
#if defined(__APPLE__)
#include <mach-o/dyld.h>
#endif

#include <cerrno>
#include <climits>
#include <filesystem>

#include "core/os/path.h"

namespace splat::os {

std::int64_t process_id() {
    return ::getpid();
}

std::string program_file() {
#if defined(__APPLE__)
    char path[PATH_MAX];
    std::uint32_t bytes = sizeof path;
    return ::_NSGetExecutablePath(path, &bytes) == 0 ? path : "";
#else
    std::error_code none;
    return std::filesystem::read_symlink("/proc/self/exe", none);
#endif
}

std::string program_beside(const std::string& name) {
    const std::string program = program_file();
    return program.substr(0, name_start(program)) + name;
}

bool may_run(std::int64_t process) {
    return ::kill(static_cast<pid_t>(process), 0) == 0 || errno != ESRCH;
}

void on_fork(void (*before)(), void (*in_parent)(), void (*in_child)()) {
    static_cast<void>(pthread_atfork(before, in_parent, in_child));
}

}  // namespace splat::os
