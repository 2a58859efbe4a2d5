#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "core/os/child.h"

#if defined(__APPLE__)
#include <crt_externs.h>  // libraries of Macs do not see `environ`
#define environ (*_NSGetEnviron())
#else
extern char** environ;  // NOLINT(readability-redundant-declaration): some C libraries lack it
#endif

namespace splat::os {
namespace {

constexpr int kGraceMs = 5000;  ///< for a program that is asked to end
constexpr int kGraceStepMs = 20;

void close_handle(Handle& file) {
    if (file != kNoHandle) ::close(file);
    file = kNoHandle;
}

/// Both ends of what connects a stream of a child with this process.
struct Ends {
    Handle child = kNoHandle, ours = kNoHandle;
    Ends() = default;
    ~Ends() { close_handle(child), close_handle(ours); }
    Ends(const Ends&) = delete;
    Ends& operator=(const Ends&) = delete;
    Handle take() { return std::exchange(ours, kNoHandle); }
};

/// Neither end is inherited but as a stream. Returns an error number.
int keep(const int (&ends)[2]) {
#if defined(__APPLE__)
    for (const int end : ends)
        if (::fcntl(end, F_SETFD, FD_CLOEXEC) != 0) return errno;
#else
    static_cast<void>(ends);
#endif
    return 0;
}

int open_pipe(Ends& ends) {
    int both[2];
#if defined(__APPLE__)
    if (::pipe(both) != 0) return errno;
#else
    if (::pipe2(both, O_CLOEXEC) != 0) return errno;
#endif
    ends.ours = both[0];
    ends.child = both[1];
    return keep(both);
}

/// A socket: writing to one that nobody reads is an error, not a signal.
int open_socket(Ends& ends) {
    int both[2];
#if defined(__APPLE__)
    const int type = SOCK_STREAM;
#else
    const int type = SOCK_STREAM | SOCK_CLOEXEC;
#endif
    if (::socketpair(AF_UNIX, type, 0, both) != 0) return errno;
    ends.ours = both[0];
    ends.child = both[1];
#if defined(SO_NOSIGPIPE)
    const int on = 1;
    ::setsockopt(ends.ours, SOL_SOCKET, SO_NOSIGPIPE, &on, sizeof on);
#endif
    return keep(both);
}

/// What posix_spawn() takes.
struct Spawn {
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    Spawn() {
        posix_spawn_file_actions_init(&files);
        posix_spawnattr_init(&attributes);
    }
    ~Spawn() {
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&files);
    }
    Spawn(const Spawn&) = delete;
    Spawn& operator=(const Spawn&) = delete;

    void stream(int number, Stream kind, const Ends& ends) {
        if (kind == Stream::kPiped) posix_spawn_file_actions_adddup2(&files, ends.child, number);
        if (kind == Stream::kNone)
            posix_spawn_file_actions_addopen(&files, number, "/dev/null",
                                             number == STDIN_FILENO ? O_RDONLY : O_WRONLY, 0);
    }
};

std::vector<char*> pointers(const std::vector<std::string>& texts) {
    std::vector<char*> all;
    for (const std::string& text : texts) all.push_back(const_cast<char*>(text.c_str()));
    all.push_back(nullptr);
    return all;
}

std::vector<std::string> environment_with(
    const std::vector<std::pair<std::string, std::string>>& variables) {
    std::vector<std::string> all;
    for (const auto& [name, value] : variables) all.push_back(name + "=" + value);
    for (char** at = environ; *at != nullptr; ++at) {
        const std::string_view text = *at;
        bool anew = false;
        for (const auto& [name, value] : variables) anew = anew || text.starts_with(name + "=");
        if (!anew) all.emplace_back(text);
    }
    return all;
}

}  // namespace

int Child::start(const std::vector<std::string>& words, const ChildOptions& options) {
    Ends in, out, error;
    int failed = options.in == Stream::kPiped ? open_socket(in) : 0;
    if (failed == 0 && options.out == Stream::kPiped) failed = open_pipe(out);
    if (failed == 0 && options.error == Stream::kPiped && !options.joined)
        failed = open_pipe(error);
    if (failed != 0) return failed;
    Spawn spawn;
    spawn.stream(STDIN_FILENO, options.in, in);
    spawn.stream(STDOUT_FILENO, options.out, out);
    if (options.joined)
        posix_spawn_file_actions_adddup2(&spawn.files, STDOUT_FILENO, STDERR_FILENO);
    else
        spawn.stream(STDERR_FILENO, options.error, error);
    if (options.own_group) {
        posix_spawnattr_setflags(&spawn.attributes, POSIX_SPAWN_SETPGROUP);
        posix_spawnattr_setpgroup(&spawn.attributes, 0);
    }
    const std::vector<char*> arguments = pointers(words);
    const std::vector<std::string> environment = environment_with(options.variables);
    pid_t process = 0;
    failed = posix_spawnp(&process, arguments[0], &spawn.files, &spawn.attributes, arguments.data(),
                          pointers(environment).data());
    if (failed != 0) return failed;
    process_ = process;
    asked_by_group_ = options.own_group;
    in_ = in.take();
    out_ = out.take();
    error_ = error.take();
    return 0;
}

bool Child::write(std::string_view bytes) {
#if defined(MSG_NOSIGNAL)
    constexpr int kFlags = MSG_NOSIGNAL;
#else
    constexpr int kFlags = 0;
#endif
    while (!bytes.empty()) {
        const ssize_t sent = ::send(in_, bytes.data(), bytes.size(), kFlags);
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) return false;
        bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
}

void Child::close_input() {
    close_handle(in_);
}

void Child::close_output() {
    close_handle(out_);
    close_handle(error_);
}

std::optional<Output> Child::read(void* to, std::size_t bytes, int wait_ms) {
    if (out_ == kNoHandle && error_ == kNoHandle) return std::nullopt;
    std::array<pollfd, 2> files = {{{out_, POLLIN, 0}, {error_, POLLIN, 0}}};
    if (::poll(files.data(), files.size(), wait_ms) <= 0) return Output{};
    errors_first_ = files[1].revents != 0 && (files[0].revents == 0 || !errors_first_);
    Handle& file = errors_first_ ? error_ : out_;
    const ssize_t got = ::read(file, to, bytes);
    if (got > 0) return Output{errors_first_, static_cast<std::size_t>(got)};
    if (got == 0 || errno != EINTR) close_handle(file);
    return Output{};
}

int Child::wait() {
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0)
        if (errno != EINTR) return -1;
    process_ = kNoHandle;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void Child::end() {
    if (process_ == kNoHandle) return;
    const pid_t process = std::exchange(process_, kNoHandle);
    const pid_t asked = asked_by_group_ ? -process : process;
    ::kill(asked, SIGTERM);
    for (int waited = 0; waited < kGraceMs; waited += kGraceStepMs) {
        if (::waitpid(process, nullptr, WNOHANG) != 0) return;
        ::poll(nullptr, 0, kGraceStepMs);
    }
    ::kill(asked, SIGKILL);
    ::waitpid(process, nullptr, 0);
}

int run_instead(const std::string& program, char** words) {
    ::execv(program.c_str(), words);
    return errno;
}

}  // namespace splat::os
