#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace vkrun {

/// The files of a training run:
///
///   config.json            every value of the configuration
///   run.json               state, versions, device, data, seed
///   log.txt                messages
///   metrics.jsonl          one JSON object per line: training losses, validations
///   tb/                    the same for TensorBoard
///   checkpoints/           step_N.state.safetensors, the last two: all that the next step depends on
///   weights_last.safetensors, weights_best.safetensors   averaged weights
///   renders/               input, truth and prediction of validation objects
class RunFolder {
  public:
    /// Throws a Failure for a run that may not be replaced, or without a run to resume.
    static void check(const std::string& path, bool resume, bool overwrite);

    /// A new folder, or that of the run to resume.
    RunFolder(const std::string& path, bool resume);

    [[nodiscard]] std::filesystem::path path(const std::string& name) const { return root_ / name; }

    void log(const std::string& line);  ///< to log.txt and standard error
    void metric(const Json& line);

    /// Saved states, the latest first.
    [[nodiscard]] std::vector<std::filesystem::path> states() const;
    [[nodiscard]] std::filesystem::path state_path(std::uint64_t step) const;
    void keep_latest_states(std::size_t count) const;

    /// Remove metrics of steps that will run again, and a truncated last line.
    void cut_metrics(std::uint64_t last_step);

    /// All lines that can be read.
    [[nodiscard]] static std::vector<Json> metrics(const std::filesystem::path& root);

  private:
    std::filesystem::path root_;
    std::ofstream log_, metrics_;
};

}  // namespace vkrun
