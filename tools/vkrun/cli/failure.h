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
    Failure(ExitCode code, const std::string& sentence, int result = 0)
        : std::runtime_error(sentence), code_(code), result_(result) {}
    [[nodiscard]] ExitCode code() const { return code_; }
    /// The splat_result of the library; 0 if it was not its call that failed.
    [[nodiscard]] int result() const { return result_; }

  private:
    ExitCode code_;
    int result_;
};

/// The failure with advice of this command's own in place of that of the library, if its sentence has that.
inline Failure with_advice(const Failure& failure, const std::string& of_library,
                           const std::string& own) {
    std::string sentence = failure.what();
    const std::size_t at = sentence.find(of_library);
    if (at != std::string::npos) sentence.replace(at, of_library.size(), own);
    return Failure(failure.code(), sentence, failure.result());
}

}  // namespace vkrun
