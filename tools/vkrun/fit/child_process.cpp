#include "vkrun/fit/child_process.h"

#include <array>
#include <cerrno>
#include <fstream>
#include <optional>

#include "core/os/child.h"
#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/train/run_signals.h"

namespace vkrun {
namespace {

constexpr int kPollMs = 1000;

/// Cuts bytes into lines, which also a carriage return ends.
class Lines {
  public:
    explicit Lines(const ChildOutput& output) : output_(output) {
        if (output.log.empty()) return;
        log_.emplace(splat::os::path_of(output.log), std::ios::app | std::ios::binary);
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

/// Passes on what comes until the child closes its streams.
void read_all(splat::os::Child& child, const ChildOutput& output, Lines& lines) {
    std::array<char, 1 << 16> buffer;
    while (const auto got = child.read(buffer.data(), buffer.size(), kPollMs)) {
        check_interrupted();
        if (got->bytes == 0) continue;
        if (output.bytes && !got->error)
            output.bytes(buffer.data(), got->bytes);
        else
            lines.add(buffer.data(), got->bytes);
    }
}

}  // namespace

int run_child(const std::vector<std::string>& words, const ChildOutput& output) {
    using splat::os::Stream;
    check_interrupted();
    Lines lines(output);
    std::string command = "\n$";
    for (const std::string& word : words) command += " '" + word + "'";
    if (!output.log.empty())
        std::ofstream(splat::os::path_of(output.log), std::ios::app | std::ios::binary)
            << command << '\n';
    // Both streams of a program that makes lines share a pipe, so that they stay in order.
    splat::os::Child child;
    const int failed = child.start(words, {.in = Stream::kNone,
                                           .out = Stream::kPiped,
                                           .error = Stream::kPiped,
                                           .joined = !output.bytes,
                                           .own_group = true});
    if (failed == ENOENT) return kNotInstalled;
    if (failed != 0)
        throw Failure(kFailed, "cannot start '" + words[0] + "': " + splat::os::reason(failed));
    read_all(child, output, lines);
    lines.finish();
    const int status = child.wait();
    if (status < 0) throw Failure(kFailed, "cannot wait for a program");
    check_interrupted();
    return status;
}

}  // namespace vkrun
