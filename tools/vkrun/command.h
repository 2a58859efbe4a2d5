#pragma once

#include <stdexcept>
#include <string>

namespace CLI {
class App;
}

namespace vkrun {

/// Exit statuses of vkrun, as its help states them.
enum ExitCode : int {
    kSuccess = 0,
    kFailed = 1,
    kUsageError = 2,
    kNoDevice = 3,
    kBadData = 4,
    kOutOfMemory = 5,
    kGateMissed = 6,  ///< a comparison found a loss, a gate was missed
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

/// Each adds one command to the command line; the command leaves its status in `exit_code`.
void add_devices(CLI::App& app, int& exit_code);
void add_doctor(CLI::App& app, int& exit_code);
void add_bench(CLI::App& app, int& exit_code);
void add_bench_model(CLI::App& bench, int& exit_code);   ///< below `bench`
void add_bench_raster(CLI::App& bench, int& exit_code);  ///< below `bench`
void add_bench_start(CLI::App& bench, int& exit_code);   ///< below `bench`
void add_data(CLI::App& app, int& exit_code);
void add_config(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_convert(CLI::App& app, int& exit_code);
void add_inspect(CLI::App& app, int& exit_code);
void add_render(CLI::App& app, int& exit_code);
void add_weights(CLI::App& app, int& exit_code);
void add_train(CLI::App& app, int& exit_code);
void add_eval(CLI::App& app, int& exit_code);
void add_predict(CLI::App& app, int& exit_code);
void add_report(CLI::App& app, int& exit_code);
void add_weights_model(CLI::App& weights, int& exit_code);  ///< below `weights`

}  // namespace vkrun
