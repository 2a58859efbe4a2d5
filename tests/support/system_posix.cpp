#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <system_error>
#include <thread>

#include "support/system.h"

namespace splat::test {
namespace {

constexpr uid_t kNobody = 65534;

}  // namespace

void set_variable(const std::string& name, const std::string& value) {
    ::setenv(name.c_str(), value.c_str(), 1);
}

void unset_variable(const std::string& name) {
    ::unsetenv(name.c_str());
}

bool make_fifo(const std::string& path) {
    return ::mkfifo(path.c_str(), 0600) == 0;
}

bool makes_links_in(const std::string&) {
    return true;
}

bool is_root() {
    return ::geteuid() == 0;
}

FileLimit::FileLimit(std::uint64_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    rlimit limit{};
    ::getrlimit(RLIMIT_FSIZE, &limit);
    before_ = limit.rlim_cur;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
}

FileLimit::~FileLimit() {
    rlimit limit{};
    ::getrlimit(RLIMIT_FSIZE, &limit);
    limit.rlim_cur = before_;
    ::setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, handler_);
}

AnotherUser::AnotherUser() : was_root_(is_root() && ::seteuid(kNobody) == 0) {}

AnotherUser::~AnotherUser() {
    if (was_root_ && ::seteuid(0) != 0) ADD_FAILURE() << "cannot be root again";
}

NoMoreThreads::NoMoreThreads() : was_root_(is_root()) {
    rlimit limit{};
    ::getrlimit(RLIMIT_NPROC, &limit);
    before_ = limit.rlim_cur;
    limit.rlim_cur = 0;
    ::setrlimit(RLIMIT_NPROC, &limit);
    if (was_root_) {
        EXPECT_EQ(::setresuid(kNobody, kNobody, 0), 0);
    }
}

NoMoreThreads::~NoMoreThreads() {
    if (was_root_) {
        EXPECT_EQ(::setresuid(0, 0, 0), 0);
    }
    ::prctl(PR_SET_DUMPABLE, 1);  // the leak check needs it
    rlimit limit{};
    ::getrlimit(RLIMIT_NPROC, &limit);
    limit.rlim_cur = before_;
    ::setrlimit(RLIMIT_NPROC, &limit);
}

bool NoMoreThreads::works() const {
    try {
        std::thread([] {}).join();
        return false;
    } catch (const std::system_error&) {
        return true;
    }
}

Child::Child(const std::function<int()>& body) {
    std::fflush(nullptr);
    process_ = ::fork();
    if (process_ == 0) ::_exit(body());
}

int Child::wait() const {
    int status = 0;
    if (::waitpid(static_cast<pid_t>(process_), &status, 0) != process_) return -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

void end_after(unsigned seconds) {
    ::alarm(seconds);
}

std::uint64_t peak_bytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

double processor_seconds() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

}  // namespace splat::test
