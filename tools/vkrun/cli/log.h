#pragma once

#include <string>

namespace vkrun {

/// Send the library's messages to standard error: warnings, or all of them after set_verbose(true).
void log_to_stderr();
void set_verbose(bool verbose);

/// Shows what the library tells of its work, too, until the end of the scope.
class ShowInfo {
  public:
    ShowInfo();
    ~ShowInfo();
    ShowInfo(const ShowInfo&) = delete;
    ShowInfo& operator=(const ShowInfo&) = delete;
};

/// Begin messages of this process, one of several, with `who`. Warnings, which the first one tells, are left out
/// unless all messages are shown.
void speak_as(const std::string& who);

/// Print the error that ends this process.
void print_failure(const std::string& sentence);

}  // namespace vkrun
