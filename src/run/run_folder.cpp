#include "run/run_folder.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <sstream>

#include "core/fork.h"
#include "core/os/path.h"
#include "core/os/process.h"
#include "io/file.h"
#include "io/folder.h"

namespace splat::run {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStateSuffix = ".state.safetensors";
constexpr const char* kUnreadable = ".unreadable";
constexpr const char* kConfig = "config.json";
constexpr const char* kLock = "lock";
constexpr const char* kLog = "log.txt";
constexpr const char* kMetrics = "metrics.jsonl";
constexpr const char* kRun = "run.json";
constexpr const char* kPrepared = "prepared.json";  ///< a tool made input of a run in the folder
constexpr const char* kTemporary =
    ".tmp";  ///< the end of what io::write_file() has not yet renamed

/// Files that a run and the tools that show it write; anything else in the folder is the user's.
constexpr const char* kOwnFolders[] = {"", "checkpoints/", "eval/", "renders/", "tb/"};
constexpr const char* kOwnFiles[] = {kConfig,
                                     kRun,
                                     kLog,
                                     kMetrics,
                                     "report.html",
                                     "transforms.json",
                                     "checkpoints/step_*.state.safetensors",
                                     "checkpoints/step_*.state.safetensors.unreadable",
                                     "eval/objects.json",
                                     "eval/per_image.csv",
                                     "eval/per_object.csv",
                                     "eval/per_view.csv",
                                     "eval/report.html",
                                     "eval/results.json",
                                     "eval/scores.txt",
                                     "renders/best.json",
                                     "renders/best.ply",
                                     "renders/step_*.png",
                                     "tb/events.out.tfevents.*"};

Status cannot(const char* doing, const fs::path& path, const std::string& reason) {
    return error(Code::kIo, "cannot %s '%s': %s", doing, os::text_of(path).c_str(), reason.c_str());
}

Status make_folder(const fs::path& path) {
    if (os::make_folders(os::text_of(path)) == 0) return {};
    return cannot("make the folder", path, os::reason(errno));
}

/// Names in a folder; none if it is not there, or no folder. Errors: kIo.
Result<std::vector<std::string>> names_in(const fs::path& folder) {
    auto names = io::names_in(os::text_of(folder));
    if (names.status().code() == Code::kNotFound) return std::vector<std::string>();
    return names;
}

/// What is there, if anything is.
std::optional<os::FileKind> kind_of(const fs::path& path) {
    os::FileInfo info;
    if (os::examine(os::text_of(path), info) != 0) return std::nullopt;
    return info.kind;
}

bool is_there(const fs::path& path) {
    return kind_of(path).has_value();
}

/// What a run that ended before its first file leaves.
bool is_begun(const std::string& name) {
    return name == kLock || (name.starts_with(kConfig) && name.ends_with(kTemporary));
}

std::string process_of(os::Handle lock) {
    char text[32] = {};
    const std::int64_t got = os::read(lock, text, sizeof text - 1, 0);
    std::string process(text, static_cast<std::size_t>(std::max<std::int64_t>(got, 0)));
    process.erase(std::min(process.find('\n'), process.size()));
    return process.empty() ? "another process" : "process " + process;
}

/// Whether a path is of a pattern, in which '*' stands for any part of a name.
bool matches(std::string_view path, std::string_view pattern) {
    while (!pattern.empty() && pattern[0] != '*') {
        if (path.empty() || path[0] != pattern[0]) return false;
        path.remove_prefix(1);
        pattern.remove_prefix(1);
    }
    if (pattern.empty()) return path.empty();
    for (pattern.remove_prefix(1); !matches(path, pattern); path.remove_prefix(1))
        if (path.empty() || path[0] == '/') return false;
    return true;
}

/// The number of this process, alone in the file, which was just opened.
Status write_process(os::Handle lock, const fs::path& path) {
    if (os::resize(lock, 0) != 0) return cannot("write", path, os::reason(errno));
    const std::string text = std::to_string(os::process_id()) + "\n";
    return io::write_all(lock, io::as_bytes(text), os::text_of(path));
}

}  // namespace

Result<std::unique_ptr<RunFolder>> RunFolder::open(const std::string& path, Mode mode) {
    if (path.empty()) return invalid("the folder of the run has no name");
    std::unique_ptr<RunFolder> self(new RunFolder(path, mode));
    SPLAT_TRY(self->check());
    // A new folder is made and locked by begin(), once everything else is known to be right.
    if (is_there(self->root_ / kConfig)) SPLAT_TRY(self->lock());
    return self;
}

RunFolder::~RunFolder() {
    if (lock_ == os::kNoHandle) return;
    // A forked child has the handle, too: without this the lock would last as long as the child.
    if (generation_ == fork_generation()) os::unlock(lock_);
    os::close(lock_);
}

Status RunFolder::check() const {
    // The lock is made before config.json; a run that was copied may lack it.
    const bool run =
        is_there(root_ / kConfig) && (is_there(root_ / kLock) || is_there(root_ / kRun));
    if (mode_ == Mode::kResume) {
        if (run) return {};
        return bad_state("'%s' holds no run to resume (%s, and %s or %s)",
                         os::text_of(root_).c_str(), kConfig, kLock, kRun);
    }
    bool empty = !is_there(root_);
    if (kind_of(root_) == os::FileKind::kFolder) {
        SPLAT_ASSIGN(const std::vector<std::string> names, names_in(root_));
        empty = !run && (is_there(root_ / kPrepared) || std::ranges::all_of(names, is_begun));
    }
    if (empty || (run && mode_ == Mode::kReplace)) return {};
    return bad_state("'%s' is there%s", os::text_of(root_).c_str(),
                     run ? " and holds a run: resume it, overwrite it, or choose another folder"
                         : " and is not a run: choose another folder");
}

Status RunFolder::lock() {
    if (lock_ != os::kNoHandle) return {};
    const fs::path path = root_ / kLock;
    const os::Handle file = os::open(os::text_of(path), os::Open::kUpdate);
    if (file == os::kNoHandle) return cannot("open", path, os::reason(errno));
    if (os::lock(file, os::Lock::kExclusive, false) != 0) {
        const int reason = errno;
        const std::string process = process_of(file);
        os::close(file);
        if (reason != EWOULDBLOCK) return cannot("lock", path, os::reason(reason));
        return bad_state(
            "'%s' is in use: a run of %s is open in it; wait for its end, stop it, or "
            "choose another folder",
            os::text_of(root_).c_str(), process.c_str());
    }
    lock_ = file;
    generation_ = fork_generation();
    return write_process(file, path);
}

/// Own files that are there, with `suffix`, a pattern, after their names.
Result<std::vector<fs::path>> RunFolder::own_files(const std::vector<std::string>& results,
                                                   const char* suffix) const {
    std::vector<std::string> own(std::begin(kOwnFiles), std::end(kOwnFiles));
    for (const std::string& result : results)
        for (const char* which : {"_last", "_best"}) own.push_back(result + which + ".safetensors");
    std::vector<fs::path> found;
    for (const std::string folder : kOwnFolders) {
        SPLAT_ASSIGN(const std::vector<std::string> names, names_in(root_ / folder));
        for (const std::string& name : names)
            if (std::ranges::any_of(own, [&](const std::string& pattern) {
                    return matches(folder + name, pattern + suffix);
                }))
                found.push_back(root_ / folder / name);
    }
    return found;
}

Status RunFolder::clear(const std::vector<std::string>& results) const {
    SPLAT_ASSIGN(const std::vector<fs::path> files, own_files(results, ""));
    for (const fs::path& file : files) {
        if (file.filename() == kConfig) continue;
        if (os::remove(os::text_of(file)) != 0 && errno != ENOENT)
            return cannot("remove", file, os::reason(errno));
    }
    for (const std::string folder : kOwnFolders)
        if (!folder.empty())
            os::remove(os::text_of(root_ / folder));  // fails where the user keeps files
    return {};
}

Result<std::size_t> RunFolder::begin(const std::string& config,
                                     const std::vector<std::string>& results) {
    SPLAT_TRY(make_folder(root_));
    SPLAT_TRY(lock());
    SPLAT_TRY(check());  // what another process did before the lock was ours
    SPLAT_ASSIGN(const std::vector<fs::path> unfinished, own_files(results, ".*-*.tmp"));
    std::size_t removed = 0;
    for (const fs::path& file : unfinished)
        if (kind_of(file) == os::FileKind::kFile && os::remove(os::text_of(file)) == 0) ++removed;
    if (mode_ != Mode::kResume) SPLAT_TRY(clear(results));
    SPLAT_TRY(write(kConfig, config));
    SPLAT_TRY(make_folder(root_ / "checkpoints"));
    for (const char* name : {kLog, kMetrics}) SPLAT_TRY(io::append_file(path(name), {}));
    return removed;
}

Status RunFolder::log(const std::string& line) const {
    return io::append_file(path(kLog), io::as_bytes(line + "\n"));
}

Status RunFolder::metric(const std::string& json) const {
    return io::append_file(path(kMetrics), io::as_bytes(json + "\n"));
}

Status RunFolder::write(const char* name, const std::string& text) const {
    return io::write_file(path(name), io::as_bytes(text));
}

Result<std::vector<fs::path>> RunFolder::states() const {
    std::vector<fs::path> found;
    SPLAT_ASSIGN(const std::vector<std::string> names, names_in(root_ / "checkpoints"));
    for (const std::string& name : names)
        if (name.starts_with("step_") && name.ends_with(kStateSuffix))
            found.push_back(root_ / "checkpoints" / name);
    std::ranges::reverse(found);
    return found;
}

Status RunFolder::set_aside(const fs::path& state) const {
    fs::path aside = state;
    aside += kUnreadable;
    if (os::rename(os::text_of(state), os::text_of(aside)) == 0) return {};
    return cannot("rename", state, os::reason(errno));
}

std::string RunFolder::state_path(std::uint64_t step) const {
    return path(format("checkpoints/step_%010llu%s", llu(step), kStateSuffix));
}

void RunFolder::keep_latest_states(std::size_t count) const {
    const auto all = states();  // what cannot be listed stays
    for (std::size_t i = count; all.ok() && i < all.value().size(); ++i)
        os::remove(os::text_of(all.value()[i]));
}

std::optional<double> MetricLine::number(const char* name) const {
    const JsonTree* const found = json.find(name);
    if (found == nullptr) return std::nullopt;
    return found->is_null() ? NAN : found->number();
}

Result<std::vector<MetricLine>> RunFolder::metrics() const {
    std::vector<MetricLine> lines;
    const auto file = io::read_file(path(kMetrics));
    if (file.status().code() == Code::kNotFound) return lines;
    SPLAT_TRY(file.status());
    std::istringstream rest{std::string(io::as_text(file.value()))};
    for (std::string text; std::getline(rest, text);) {
        Result<JsonTree> json = parse_json_tree(text, kMetrics);
        const auto step = json.ok() ? json.value()["step"].count() : std::nullopt;
        if (step) lines.push_back({*step, std::move(json.value()), std::move(text)});
    }
    return lines;
}

Status RunFolder::cut_metrics(std::uint64_t last_step) const {
    std::string text;
    SPLAT_ASSIGN(const std::vector<MetricLine> lines, metrics());
    for (const MetricLine& line : lines)
        if (line.step <= last_step) text += line.text + "\n";
    return write(kMetrics, text);
}

}  // namespace splat::run
