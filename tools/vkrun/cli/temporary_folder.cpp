#include "vkrun/cli/temporary_folder.h"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>

#include "vkrun/cli/failure.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPrefix = "vkrun-";
constexpr const char* kLock = ".vkrun-lock";
constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};

char g_folder[PATH_MAX];  ///< removed by a signal; empty: none

/// Only what a handler may call: the folder is removed by another program. _Fork() runs no handlers and takes no locks,
/// which this thread may hold.
void on_signal(int signal) {
#if __GLIBC_PREREQ(2, 34)
    const pid_t child = g_folder[0] == '\0' ? -1 : _Fork();
#else
    const pid_t child = -1;
#endif
    if (child == 0) {
        execl("/bin/rm", "rm", "-rf", "--", g_folder, static_cast<char*>(nullptr));
        _exit(1);
    }
    if (child > 0) waitpid(child, nullptr, 0);
    ::signal(signal, SIG_DFL);
    raise(signal);
}

fs::path place() {
    const char* const named = std::getenv("TMPDIR");
    return named == nullptr || *named == '\0' ? "/tmp" : named;
}

/// A file in each of our folders, locked as long as its process lives; -1: it is not ours.
int lock_in(const fs::path& folder, int flags) {
    const int file = open((folder / kLock).c_str(), flags | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) return file;
    if (file >= 0) close(file);
    return -1;
}

/// What killed processes of this user left: folders with a lock that nobody holds.
void remove_stale() {
    std::error_code ignored;
    for (fs::directory_iterator entry(place(), ignored), end; !ignored && entry != end;
         entry.increment(ignored)) {
        struct stat info {};
        if (!entry->path().filename().string().starts_with(kPrefix) ||
            lstat(entry->path().c_str(), &info) != 0 || !S_ISDIR(info.st_mode) ||
            info.st_uid != geteuid())
            continue;
        const int lock = lock_in(entry->path(), O_RDONLY);
        if (lock < 0) continue;
        std::error_code failed;
        fs::remove_all(entry->path(), failed);
        close(lock);
    }
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
    remove_stale();
    std::string name = (place() / (std::string(kPrefix) + "XXXXXX")).string();
    if (mkdtemp(name.data()) == nullptr)
        throw Failure(kFailed, "cannot make a folder like '" + name + "': " + std::strerror(errno) +
                                   "; set TMPDIR to another place");
    path_ = name;
    lock_ = lock_in(path_, O_WRONLY | O_CREAT | O_EXCL);
    if (g_folder[0] != '\0' || name.size() >= sizeof g_folder) return;
    std::copy_n(name.c_str(), name.size() + 1, g_folder);
    for (const int number : kSignals) {
        struct sigaction old {};
        if (sigaction(number, nullptr, &old) == 0 && old.sa_handler == SIG_DFL)
            ::signal(number, on_signal);
    }
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
    if (lock_ >= 0) close(lock_);
    if (path_ != g_folder) return;
    for (const int number : kSignals) {
        struct sigaction old {};
        if (sigaction(number, nullptr, &old) == 0 && old.sa_handler == on_signal)
            ::signal(number, SIG_DFL);
    }
    g_folder[0] = '\0';
}

}  // namespace vkrun
