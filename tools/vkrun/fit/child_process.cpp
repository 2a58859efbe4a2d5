#include "vkrun/fit/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>

#include "vkrun/cli/failure.h"
#include "vkrun/train/run_signals.h"

namespace vkrun {
namespace {

constexpr int kPollMs = 1000;
constexpr int kGraceMs = 5000;  ///< for a program that is asked to end
constexpr int kGraceStepMs = 20;

/// Both ends of a pipe; the child gets only what it is given.
struct Pipe {
    Pipe() {
        if (pipe2(ends, O_CLOEXEC) != 0)
            throw Failure(kFailed, std::string("cannot make a pipe: ") + std::strerror(errno));
    }
    ~Pipe() {
        for (int i : {0, 1}) close_end(i);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    void close_end(int i) {
        if (ends[i] >= 0) close(ends[i]);
        ends[i] = -1;
    }
    int ends[2] = {-1, -1};
};

/// A running program, which is ended with the object.
class Child {
  public:
    Child(const std::vector<std::string>& words, int output, int error) {
        std::vector<char*> arguments;
        for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
        arguments.push_back(nullptr);
        posix_spawn_file_actions_t files;
        posix_spawn_file_actions_init(&files);
        posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
        posix_spawn_file_actions_adddup2(&files, error, STDERR_FILENO);
        posix_spawnattr_t group;
        posix_spawnattr_init(&group);
        posix_spawnattr_setflags(&group, POSIX_SPAWN_SETPGROUP);
        posix_spawnattr_setpgroup(&group, 0);
        failed_ = posix_spawnp(&process_, arguments[0], &files, &group, arguments.data(), environ);
        posix_spawnattr_destroy(&group);
        posix_spawn_file_actions_destroy(&files);
    }
    ~Child() {
        if (failed_ != 0 || ended_) return;
        kill(-process_, SIGTERM);
        for (int waited = 0; waited < kGraceMs; waited += kGraceStepMs) {
            if (waitpid(process_, nullptr, WNOHANG) != 0) return;
            poll(nullptr, 0, kGraceStepMs);
        }
        kill(-process_, SIGKILL);
        waitpid(process_, nullptr, 0);
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    [[nodiscard]] int failed() const { return failed_; }  ///< an errno
    int wait() {
        int status = 0;
        while (waitpid(process_, &status, 0) < 0)
            if (errno != EINTR) throw Failure(kFailed, "cannot wait for a program");
        ended_ = true;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }

  private:
    pid_t process_ = 0;
    int failed_ = 0;
    bool ended_ = false;
};

/// Cuts bytes into lines, which also a carriage return ends.
class Lines {
  public:
    explicit Lines(const ChildOutput& output) : output_(output) {
        if (output.log.empty()) return;
        log_.emplace(output.log, std::ios::app | std::ios::binary);
    }
    void add(const char* bytes, std::size_t count) {
        if (log_) log_->write(bytes, static_cast<std::streamsize>(count));
        for (std::size_t i = 0; i < count; ++i)
            if (bytes[i] == '\n' || bytes[i] == '\r')
                finish();
            else
                line_ += bytes[i];
    }
    /// Ends the last line, and checks the log.
    void finish() {
        if (!line_.empty() && output_.line) output_.line(line_);
        line_.clear();
        if (log_ && !log_->flush())
            throw Failure(kFailed, "cannot write '" + output_.log + "': is the disk full?");
    }

  private:
    const ChildOutput& output_;
    std::optional<std::ofstream> log_;
    std::string line_;
};

void check_interrupted() {
    if (run_interrupted())
        throw Failure(kInterrupted, "interrupted: the same command goes on with what is done");
}

/// Passes on what comes until both ends are closed.
void read_all(Pipe& out, Pipe& err, const ChildOutput& output, Lines& lines) {
    std::array<char, 1 << 16> buffer;
    while (out.ends[0] >= 0 || err.ends[0] >= 0) {
        std::array<pollfd, 2> files = {{{out.ends[0], POLLIN, 0}, {err.ends[0], POLLIN, 0}}};
        const int ready = poll(files.data(), files.size(), kPollMs);
        check_interrupted();
        if (ready <= 0) continue;
        for (std::size_t i = 0; i < files.size(); ++i) {
            if (files[i].revents == 0) continue;
            const ssize_t got = read(files[i].fd, buffer.data(), buffer.size());
            if (got < 0 && errno == EINTR) continue;
            const auto count = static_cast<std::size_t>(std::max<ssize_t>(got, 0));
            if (count == 0)
                (i == 0 ? out : err).close_end(0);
            else if (i == 0 && output.bytes)
                output.bytes(buffer.data(), count);
            else
                lines.add(buffer.data(), count);
        }
    }
}

}  // namespace

int run_child(const std::vector<std::string>& words, const ChildOutput& output) {
    check_interrupted();
    Lines lines(output);
    std::string command = "\n$";
    for (const std::string& word : words) command += " '" + word + "'";
    if (!output.log.empty()) std::ofstream(output.log, std::ios::app) << command << '\n';
    Pipe out, err;
    // Both streams of a program that makes lines share a pipe, so that they stay in order.
    Child child(words, output.bytes ? out.ends[1] : err.ends[1], err.ends[1]);
    out.close_end(1);
    err.close_end(1);
    if (child.failed() == ENOENT) return kNotInstalled;
    if (child.failed() != 0)
        throw Failure(kFailed, "cannot start '" + words[0] + "': " + std::strerror(child.failed()));
    read_all(out, err, output, lines);
    lines.finish();
    const int status = child.wait();
    check_interrupted();
    return status;
}

}  // namespace vkrun
