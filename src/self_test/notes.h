#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/no_copy.h"
#include "core/os/file.h"

/// What is known of kernels: in this process, and in a file beside the pipeline cache, a line each. Keys name driver,
/// version of the library and kernels. `file` may be empty: none.
namespace splat::self_test {

bool has_passed(const std::string& file, const std::string& key);
void note_passed(const std::string& file, const std::string& key);

/// Nothing if they are not known to fail.
std::optional<std::string> why_failed(const std::string& file, const std::string& key);
void note_failed(const std::string& file, const std::string& key, const std::string& why);

/// While it lives, `file`.testing names the kernels under test and is locked. A process that ends meanwhile, as a
/// compiler may crash it, leaves that file; one that calls exit() does not. Two tests at a time: only one has the file.
class Testing : NoCopy {
  public:
    Testing(const std::string& file, const std::vector<std::string>& keys);
    ~Testing();

  private:
    std::string path_;
    os::Handle handle_;
};

/// Note a failure that may have another cause than the kernels: a process that somebody killed, a device that another
/// program's work lost. They have failed for this process; the next tests them again, and a second time is final.
void note_suspect(const std::string& file, const std::string& key, const std::string& why);

/// Keys of kernels whose test ended the process that ran it. `remove`: they are told no more.
std::vector<std::string> unfinished(const std::string& file, bool remove);

}  // namespace splat::self_test
