#include "vkrun/cli/temporary_folder.h"

#include <signal.h>
#include <stdlib.h>
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
constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};

char g_folder[PATH_MAX];  ///< that a signal removes; empty: none

/// Only what a handler may call: the folder is removed by another program.
void on_signal(int signal) {
    const pid_t child = g_folder[0] == '\0' ? -1 : fork();
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

/// What processes left that were killed: "vkrun-<process>-XXXXXX".
void remove_stale() {
    std::error_code ignored;
    for (fs::directory_iterator entry(place(), ignored), end; !ignored && entry != end;
         entry.increment(ignored)) {
        const std::string name = entry->path().filename().string();
        if (!name.starts_with(kPrefix)) continue;
        const int process = std::atoi(name.c_str() + std::strlen(kPrefix));
        std::error_code failed;
        if (process > 0 && kill(process, 0) != 0 && errno == ESRCH)
            fs::remove_all(entry->path(), failed);
    }
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
    remove_stale();
    std::string name = (place() / (kPrefix + std::to_string(getpid()) + "-XXXXXX")).string();
    if (mkdtemp(name.data()) == nullptr)
        throw Failure(kFailed, "cannot make a folder like '" + name + "': " + std::strerror(errno) +
                                   "; set TMPDIR to another place");
    path_ = name;
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
    if (path_ != g_folder) return;
    for (const int number : kSignals) {
        struct sigaction old {};
        if (sigaction(number, nullptr, &old) == 0 && old.sa_handler == on_signal)
            ::signal(number, SIG_DFL);
    }
    g_folder[0] = '\0';
}

}  // namespace vkrun
