#pragma once

#if !defined(_WIN32)
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>

#include "support/system.h"

namespace splat::test {

/// What a call costs in a process of its own, and what it returns as text. Windows, whose processes do not fork, runs
/// it in this one, and counts how far it raises the peak of memory.
struct ChildCost {
    std::string answer;       ///< "" if the process died
    std::uint64_t bytes = 0;  ///< the most memory, beyond that of a child that does nothing
    double seconds = 0;       ///< time of the processor, so that other processes do not count
};

#if defined(_WIN32)
inline ChildCost cost_of(const std::function<std::string()>& body) {
    const std::uint64_t bytes = peak_bytes();
    const double start = processor_seconds();
    ChildCost cost{"an exception"};
    try {
        cost.answer = body();
    } catch (...) {
    }
    cost.seconds = processor_seconds() - start;
    cost.bytes = peak_bytes() - bytes;
    return cost;
}
#else
inline std::pair<ChildCost, std::uint64_t> run_child(const std::function<std::string()>& body) {
    int ends[2];
    if (::pipe(ends) != 0) return {};
    std::fflush(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
        // A bomb that goes off must not take the machine.
        const rlimit most{std::uint64_t{6} << 30U, std::uint64_t{6} << 30U};
        static_cast<void>(::setrlimit(RLIMIT_AS, &most));
#endif
        std::string answer = "an exception";
        try {
            answer = body();
        } catch (...) {
        }
        answer.resize(std::min<std::size_t>(answer.size(), 4000));  // no more than a pipe holds
        ::_exit(::write(ends[1], answer.data(), answer.size()) < 0 ? 1 : 0);
    }
    ::close(ends[1]);
    ChildCost cost;
    char text[4096];
    for (ssize_t got = 0; (got = ::read(ends[0], text, sizeof text)) > 0;)
        cost.answer.append(text, static_cast<std::size_t>(got));
    ::close(ends[0]);
    int status = 0;
    rusage usage{};
    if (child < 0 || ::wait4(child, &status, 0, &usage) != child || status != 0) cost.answer = "";
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    cost.seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    return {cost, static_cast<std::uint64_t>(usage.ru_maxrss) * 1024};
}

inline ChildCost cost_of(const std::function<std::string()>& body) {
    const std::uint64_t before = run_child([] { return std::string("nothing"); }).second;
    auto [cost, bytes] = run_child(body);
    cost.bytes = bytes - std::min(bytes, before);
    return cost;
}
#endif

}  // namespace splat::test
