#include "core/os/process.h"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>

namespace splat::os {

std::int64_t process_id() {
    return ::getpid();
}

bool may_run(std::int64_t process) {
    return ::kill(static_cast<pid_t>(process), 0) == 0 || errno != ESRCH;
}

void on_fork(void (*before)(), void (*in_parent)(), void (*in_child)()) {
    static_cast<void>(pthread_atfork(before, in_parent, in_child));
}

}  // namespace splat::os
