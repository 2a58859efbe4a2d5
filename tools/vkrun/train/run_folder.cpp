#include "vkrun/train/run_folder.h"

#include <algorithm>
#include <cstdio>

#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr const char* kStateSuffix = ".state.safetensors";

}  // namespace

void RunFolder::check(const std::string& path, bool resume, bool overwrite) {
    namespace fs = std::filesystem;
    const fs::path root(path);
    const bool run = fs::exists(root / "config.json");
    if (resume && !run)
        throw Failure(kUsageError, "--resume: '" + path + "' holds no run (no config.json)");
    const bool empty = !fs::exists(root) || (fs::is_directory(root) && fs::is_empty(root));
    if (resume || empty || (run && overwrite)) return;
    throw Failure(kUsageError,
                  "'" + path + "' is there" +
                      (run ? ": continue it with --resume, replace it with --overwrite, or "
                             "choose another --out"
                           : " and is not a run: choose another --out"));
}

RunFolder::RunFolder(const std::string& path, bool resume) : root_(path) {
    if (!resume) std::filesystem::remove_all(root_);
    for (const char* folder : {"checkpoints", "renders"}) make_folder(root_ / folder);
    log_.open(root_ / "log.txt", std::ios::app);
    metrics_.open(root_ / "metrics.jsonl", std::ios::app);
    if (!log_ || !metrics_) throw Failure(kFailed, "cannot write in '" + path + "'");
}

void RunFolder::log(const std::string& line) {
    std::fprintf(stderr, "%s\n", line.c_str());
    log_ << line << std::endl;
}

void RunFolder::metric(const Json& line) {
    metrics_ << line.dump() << std::endl;
    if (!metrics_) throw Failure(kFailed, "cannot write '" + path("metrics.jsonl").string() + "'");
}

std::vector<std::filesystem::path> RunFolder::states() const {
    std::vector<std::filesystem::path> found;
    for (const auto& entry : std::filesystem::directory_iterator(root_ / "checkpoints")) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("step_") && name.ends_with(kStateSuffix))
            found.push_back(entry.path());
    }
    std::sort(found.rbegin(), found.rend());
    return found;
}

std::filesystem::path RunFolder::state_path(std::uint64_t step) const {
    return root_ / "checkpoints" /
           format("step_%010llu%s", static_cast<unsigned long long>(step), kStateSuffix);
}

void RunFolder::keep_latest_states(std::size_t count) const {
    const auto all = states();
    for (std::size_t i = count; i < all.size(); ++i) std::filesystem::remove(all[i]);
}

std::vector<Json> RunFolder::metrics(const std::filesystem::path& root) {
    std::vector<Json> lines;
    std::ifstream file(root / "metrics.jsonl");
    for (std::string line; std::getline(file, line);) {
        Json json = Json::parse(line, nullptr, false);
        if (json.is_object() && json.contains("step")) lines.push_back(std::move(json));
    }
    return lines;
}

void RunFolder::cut_metrics(std::uint64_t last_step) {
    std::string text;
    for (const Json& line : metrics(root_))
        if (line.at("step").get<std::uint64_t>() <= last_step) text += line.dump() + "\n";
    metrics_.close();
    replace_file(root_ / "metrics.jsonl", text);
    metrics_.open(root_ / "metrics.jsonl", std::ios::app);
}

}  // namespace vkrun
