#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace vkrun {

/// Where the output of a program goes.
struct ChildOutput {
    /// Called with each line of standard error, and of standard output unless `bytes` takes that.
    std::function<void(const std::string&)> line = {};
    std::function<void(const char*, std::size_t)> bytes = {};
    std::string log = {};  ///< file that gets the command and the lines; empty: none
};

/// The status of run_child() for a program that is not installed.
inline constexpr int kNotInstalled = -1;

/// Run a program, found by PATH, with these arguments as they are, and wait for its end. It has nothing to read, and a
/// process group of its own, which a signal that ends runs (run_signals.h), or an exception of the output, ends, too.
///
/// Returns its exit status, 128 + the signal that ended it, or kNotInstalled. Throws a Failure: kInterrupted after such
/// a signal, kFailed where it cannot be started or its log not be written.
int run_child(const std::vector<std::string>& words, const ChildOutput& output);

}  // namespace vkrun
