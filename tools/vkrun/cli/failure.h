#pragma once

#include <stdexcept>
#include <string>

namespace vkrun {

/// Exit statuses of vkrun, as its help states them.
enum ExitCode : int {
    kSuccess = 0,
    kFailed = 1,
    kUsageError = 2,
    kNoDevice = 3,
    kBadData = 4,
    kOutOfMemory = 5,
    kGateMissed = 6,  ///< a comparison found something worse
    kNotFinite = 7,
    kInterrupted = 130,
};

/// Ends a command: main() prints the sentence on standard error and exits with the status.
class Failure : public std::runtime_error {
  public:
    Failure(ExitCode code, const std::string& sentence)
        : std::runtime_error(sentence), code_(code) {}
    [[nodiscard]] ExitCode code() const { return code_; }

  private:
    ExitCode code_;
};

}  // namespace vkrun
