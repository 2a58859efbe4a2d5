#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/status.h"

namespace splat::train {

/// A line of metrics.jsonl.
struct MetricLine {
    std::uint64_t step = 0;
    std::optional<double> validation_psnr;  ///< NaN of a validation without a score
    /// Objects of a validation, and logging.val_views.
    std::optional<std::uint64_t> validation_objects, validation_views;
    std::string text;
};

/// The files of a training run, of one session at a time:
///
///   config.json            every value of the configuration; what makes the folder a run
///   run.json               state, versions, device, data, seed
///   log.txt                messages
///   metrics.jsonl          one JSON object per line: training losses, validations
///   checkpoints/           step_N.state.safetensors, the last two: all that the next step depends on;
///                          and, renamed to *.unreadable, those that a resumed run could not read
///   weights_last.safetensors, weights_best.safetensors   averaged weights
///   lock                   number of the process whose session is open; its lock ends with that process
///
/// Errors: kIo with path and the system's reason.
class RunFolder {
  public:
    enum class Mode { kNew, kReplace, kResume };

    /// Check that a session may begin, and lock the folder of a run. Changes no other file. Errors:
    /// kInvalidState for a folder that another session has open, or that holds what the mode does not expect.
    static Result<std::unique_ptr<RunFolder>> open(const std::string& path, Mode mode);
    ~RunFolder();
    RunFolder(const RunFolder&) = delete;
    RunFolder& operator=(const RunFolder&) = delete;

    /// Make the folder, remove the files that a replaced run or a crash left, never others, and write
    /// config.json first. Returns how many files a crash left. Errors: as open().
    Result<std::size_t> begin(const std::string& config);

    [[nodiscard]] std::string path(const std::string& name) const {
        return (root_ / name).string();
    }

    Status log(const std::string& line) const;                      ///< the whole line or nothing
    Status metric(const std::string& json) const;                   ///< the whole line or nothing
    Status write(const char* name, const std::string& text) const;  ///< the whole text or nothing

    /// Saved states, the latest first. Errors: kIo if their folder cannot be listed.
    [[nodiscard]] Result<std::vector<std::filesystem::path>> states() const;
    [[nodiscard]] std::string state_path(std::uint64_t step) const;
    void keep_latest_states(std::size_t count) const;
    /// Rename a state that cannot be read, so that it no longer counts as one. Errors: kIo.
    Status set_aside(const std::filesystem::path& state) const;

    /// Lines of metrics.jsonl that can be read. Errors: those of io::read_file, if there is such a file.
    [[nodiscard]] Result<std::vector<MetricLine>> metrics() const;

    /// Remove metrics of steps that will run again, and a truncated last line.
    Status cut_metrics(std::uint64_t last_step) const;

  private:
    RunFolder(const std::string& path, Mode mode) : root_(path), mode_(mode) {}
    [[nodiscard]] Status check() const;
    Status lock();
    Status clear() const;
    [[nodiscard]] Result<std::size_t> sweep() const;

    std::filesystem::path root_;
    Mode mode_;
    int lock_ = -1;                 ///< descriptor of the lock file
    std::uint32_t generation_ = 0;  ///< fork_generation() of the process that locked it
};

}  // namespace splat::train
