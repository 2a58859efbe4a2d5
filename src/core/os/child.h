#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/os/file.h"

/// Programs that this one runs. Words and variables are UTF-8.
namespace splat::os {

/// What a stream of a child is.
enum class Stream {
    kShared,  ///< this process has it, too
    kNone,    ///< empty, and takes all
    kPiped,   ///< what write() and read() have the other end of
};

struct ChildOptions {
    Stream in = Stream::kShared, out = Stream::kShared, error = Stream::kShared;
    bool joined = false;     ///< errors go where `out` goes, in order
    bool own_group = false;  ///< Ctrl-C and the like, in the terminal, are not for it
    std::vector<std::pair<std::string, std::string>> variables = {};  ///< set for the child alone
};

/// What came from a child; 0 bytes: nothing within the time.
struct Output {
    bool error = false;  ///< from the stream for errors
    std::size_t bytes = 0;
};

/// A child, which is ended with the object unless somebody waited for it. It inherits its three streams and no other
/// handle.
class Child {
  public:
    Child() = default;
    ~Child() {
        close_input();
        end();
        close_output();
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    /// Run a program with these words, the first of which names it: a path, or a name that the folders of PATH have,
    /// on Windows as NAME.exe. Returns an error number; ENOENT: there is no such program.
    int start(const std::vector<std::string>& words, const ChildOptions& options);

    /// False if the child does not read any more.
    bool write(std::string_view bytes);
    void close_input();
    /// What comes within so many milliseconds, or, below 0, at all; nothing once the child has closed its streams. A
    /// signal ends the waiting.
    std::optional<Output> read(void* to, std::size_t bytes, int wait_ms);

    /// Waits for its end. Returns its exit status; 128 + a signal where one ended it, which on Windows stands for
    /// Ctrl-C and faults; -1 if the system fails.
    int wait();
    /// Asks it, with its group if it has its own, to end, and ends it after five seconds. Windows asks by Ctrl-Break
    /// those that have a group and the same console; others are ended at once.
    void end();

  private:
    void close_output();

    Handle process_ = kNoHandle;
    Handle group_ = kNoHandle;  ///< what ends with it
    Handle in_ = kNoHandle, out_ = kNoHandle, error_ = kNoHandle;
    bool asked_by_group_ = false;
    bool errors_first_ = false;  ///< whose turn it is, so that no stream waits for the other
};

/// Runs another program instead of this one. Returns only if it cannot be started: an error number. `words` end with
/// a null pointer. On Windows this one waits for the end of the other, and has its status.
int run_instead(const std::string& program, char** words);

}  // namespace splat::os
