#include "core/os/console.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>

#include "core/os/path.h"

namespace splat::os {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};

bool (*g_asked)() = nullptr;
void (*g_closed_pipe)() = nullptr;
char g_folder[kLongestPath];  ///< removed by a signal; empty: none

void end_by(int signal) {
    std::signal(signal, SIG_DFL);
    ::raise(signal);
}

void on_caught(int signal) {
    if (!g_asked()) end_by(signal);
}

void on_closed_pipe(int) {
    g_closed_pipe();
}

/// Only what a handler may call: the folder is removed by another program. _Fork() runs no handlers and takes no locks,
/// which this thread may hold.
void remove_folder(int signal) {
    pid_t child = -1;
#if defined(__GLIBC__)
#if __GLIBC_PREREQ(2, 34)
    if (g_folder[0] != '\0') child = _Fork();
#endif
#endif
    if (child == 0) {
        ::execl("/bin/rm", "rm", "-rf", "--", g_folder, static_cast<char*>(nullptr));
        ::_exit(1);
    }
    if (child > 0) ::waitpid(child, nullptr, 0);
    end_by(signal);
}

/// Replace a handler by another one, if it is there.
void replace_handlers(void (*from)(int), void (*to)(int)) {
    for (const int number : kSignals) {
        struct sigaction old {};
        if (::sigaction(number, nullptr, &old) == 0 && old.sa_handler == from)
            std::signal(number, to);
    }
}

void set_handlers(void (*to)(int)) {
    std::signal(SIGINT, to);
    std::signal(SIGTERM, to);
    if (std::signal(SIGHUP, to) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

}  // namespace

char** arguments(int&, char** words) {
    return words;
}

void prepare_program() {
    // Closed ones become /dev/null, so that no file gets their numbers and the messages meant for them.
    int file = 0;
    do file = ::open("/dev/null", O_RDWR);  // the lowest number that is free
    while (file >= 0 && file <= STDERR_FILENO);
    if (file >= 0) ::close(file);
    std::signal(SIGPIPE, SIG_DFL);
    std::signal(SIGXFSZ, SIG_IGN);
}

bool errors_on_terminal() {
    return ::isatty(STDERR_FILENO) != 0;
}

void write_error(const char* text) {
    if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) {
        // nobody reads it
    }
}

void catch_interrupts(bool (*asked)(), void (*closed_pipe)()) {
    g_asked = asked;
    g_closed_pipe = closed_pipe;
    set_handlers(on_caught);
    std::signal(SIGPIPE, on_closed_pipe);
}

void release_interrupts() {
    for (const int number : kSignals)
        if (std::signal(number, SIG_DFL) == SIG_IGN) std::signal(number, SIG_IGN);
}

bool remove_when_interrupted(const std::string& folder) {
    if (g_folder[0] != '\0' || folder.size() >= sizeof g_folder) return false;
    std::copy_n(folder.c_str(), folder.size() + 1, g_folder);
    replace_handlers(SIG_DFL, remove_folder);
    return true;
}

void keep_when_interrupted() {
    replace_handlers(remove_folder, SIG_DFL);
    g_folder[0] = '\0';
}

}  // namespace splat::os
