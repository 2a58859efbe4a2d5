#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/json_tree.h"
#include "core/no_copy.h"
#include "core/os/file.h"
#include "core/os/path.h"

namespace splat::run {

/// A line of metrics.jsonl.
struct MetricLine {
    std::uint64_t step = 0;
    JsonTree json;
    std::string text;

    /// NaN for null, such as the score of a validation without one; nothing if there is no such member.
    [[nodiscard]] std::optional<double> number(const char* name) const;
};

/// The files of a run, of one session at a time:
///
///   config.json            every value of the configuration; what makes the folder a run
///   run.json               the figures of the run, its state, and facts of the task
///   log.txt                messages
///   metrics.jsonl          one JSON object per line: steps, validations
///   checkpoints/           step_N.state.safetensors, the last two: all that the next step depends on;
///                          and, renamed to *.unreadable, those that a resumed run could not read
///   transforms.json        of a fit that refines poses: its cameras
///   NAME_last.safetensors, NAME_best.safetensors   results of the task, such as "weights"
///   prepared.json          of a tool that has made the run's input in the folder, which is then as good as empty
///   lock                   number of the process whose session is open; its lock ends with that process
///
/// Errors: kIo with path and the system's reason.
class RunFolder : NoCopy {
  public:
    enum class Mode { kNew, kReplace, kResume };

    /// Check that a session may begin, and lock the folder of a run. Changes no other file. Errors:
    /// kInvalidState for a folder that another session has open, or that holds what the mode does not expect.
    static Result<std::unique_ptr<RunFolder>> open(const std::string& path, Mode mode);
    ~RunFolder();

    /// Make the folder, remove the files that a replaced run or a crash left, never others, and write
    /// config.json first. `results`: their names. Returns how many files a crash left. Errors: as open().
    Result<std::size_t> begin(const std::string& config, const std::vector<std::string>& results);

    [[nodiscard]] std::string path(const std::string& name) const {
        return os::text_of(root_ / name);
    }

    Status log(const std::string& line) const;                      ///< the whole line or nothing
    Status metric(const std::string& json) const;                   ///< the whole line or nothing
    Status write(const char* name, const std::string& text) const;  ///< the whole text or nothing

    /// Saved states, the latest first. Errors: kIo if their folder cannot be listed.
    [[nodiscard]] Result<std::vector<std::filesystem::path>> states() const;
    [[nodiscard]] std::string state_path(std::uint64_t step) const;
    [[nodiscard]] std::string last_path(const std::string& result) const {
        return path(result + "_last.safetensors");
    }
    [[nodiscard]] std::string best_path(const std::string& result) const {
        return path(result + "_best.safetensors");
    }
    void keep_latest_states(std::size_t count) const;
    /// Rename a state that cannot be read, so that it no longer counts as one. Errors: kIo.
    Status set_aside(const std::filesystem::path& state) const;

    /// Lines of metrics.jsonl that can be read. Errors: those of io::read_file, if there is such a file.
    [[nodiscard]] Result<std::vector<MetricLine>> metrics() const;

    /// Remove metrics of steps that will run again, and a truncated last line.
    Status cut_metrics(std::uint64_t last_step) const;

  private:
    RunFolder(const std::string& path, Mode mode) : root_(os::path_of(path)), mode_(mode) {}
    [[nodiscard]] Status check() const;
    Status lock();
    [[nodiscard]] Result<std::vector<std::filesystem::path>> own_files(
        const std::vector<std::string>& results, const char* suffix) const;
    Status clear(const std::vector<std::string>& results) const;

    std::filesystem::path root_;
    Mode mode_;
    os::Handle lock_ = os::kNoHandle;  ///< the lock file
    std::uint32_t generation_ = 0;     ///< fork_generation() of the process that locked it
};

}  // namespace splat::run
