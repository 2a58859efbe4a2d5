#include "vkrun/priors/map_jobs.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <map>
#include <set>

#include "core/os/path.h"
#include "core/os/process.h"
#include "vkrun/cli/handles.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

bool is_picture_file(const fs::path& path) {
    std::string extension = os::text_of(path.extension());
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return std::set<std::string>{".png", ".jpg", ".jpeg", ".webp", ".pgm", ".ppm"}.count(
               extension) != 0;
}

/// The visible entries of a folder, sorted by name.
std::vector<fs::path> entries_of(const fs::path& folder) {
    std::vector<fs::path> entries;
    std::error_code failed;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed))
        if (os::text_of(entry->path().filename()).rfind('.', 0) != 0)
            entries.push_back(entry->path());
    if (failed)
        throw Failure(kBadData,
                      "cannot read the folder '" + os::text_of(folder) + "': " + failed.message());
    std::sort(entries.begin(), entries.end());
    return entries;
}

void add_pictures(const fs::path& folder, const fs::path& to, std::vector<MapJob>& jobs) {
    std::map<std::string, fs::path> stems;
    for (const fs::path& entry : entries_of(folder)) {
        if (!is_picture_file(entry) || fs::is_directory(entry)) continue;
        const std::string stem = os::text_of(entry.stem());
        const auto [other, added] = stems.emplace(stem, entry);
        if (!added)
            throw Failure(kBadData, "'" + os::text_of(other->second) + "' and '" +
                                        os::text_of(entry) +
                                        "' would have the same maps: rename one of them");
        jobs.push_back({entry, to, stem});
    }
}

/// Folders rgb/ below a folder. Those of maps are never data sets.
void add_data_set(const fs::path& folder, const fs::path& to, int depth,
                  std::vector<MapJob>& jobs) {
    constexpr int kDeepest = 5;
    if (fs::is_directory(folder / "rgb")) return add_pictures(folder / "rgb", to, jobs);
    if (fs::exists(folder / "intrinsics.txt") || fs::is_directory(folder / "pose"))
        throw Failure(kBadData, "'" + os::text_of(folder) + "' is an object without rgb/");
    if (depth == kDeepest) return;
    for (const fs::path& entry : entries_of(folder)) {
        if (!fs::exists(entry))
            throw Failure(kBadData,
                          "'" + os::text_of(entry) + "' is a link to what does not exist");
        if (fs::is_directory(entry)) add_data_set(entry, to / entry.filename(), depth + 1, jobs);
    }
}

/// Throws a Failure, with the command that converts it, for a picture of a format that is not read.
void check_conversion(const fs::path& folder) {
    for (const fs::path& entry : entries_of(folder)) {
        std::string extension = os::text_of(entry.extension());
        for (char& c : extension)
            c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        const std::set<std::string> others = {".heic", ".heif", ".avif", ".tif", ".tiff", ".jxl"};
        splat_image image{};
        if (others.count(extension) != 0)
            check(splat_image_load(os::text_of(entry).c_str(), &image, nullptr), kBadData);
    }
}

}  // namespace

std::vector<MapJob> map_jobs(const fs::path& in, const fs::path& out, const Shard& shard) {
    std::vector<MapJob> all;
    std::error_code none;
    if (!fs::exists(in, none)) throw Failure(kBadData, "there is no '" + os::text_of(in) + "'");
    if (!fs::is_directory(in)) {
        all.push_back({in, out, os::text_of(in.stem())});
    } else {
        add_data_set(in, out, 0, all);
        if (all.empty()) add_pictures(in, out, all);
    }
    if (all.empty()) check_conversion(in);
    if (all.empty())
        throw Failure(
            kBadData,
            "'" + os::text_of(in) +
                "' holds no pictures (.png, .jpg, .webp, .pgm), and no folder rgb/ of a data set");
    std::vector<MapJob> part;
    for (std::size_t i = shard.index; i < all.size(); i += shard.count) part.push_back(all[i]);
    return part;
}

void remove_stale_files(const fs::path& folder, const Shard& shard) {
    // A process of another machine may have the file.
    const auto newest =
        fs::file_time_type::clock::now() - std::chrono::hours(shard.count > 1 ? 1 : 0);
    if (!fs::is_directory(folder)) return;
    for (const fs::path& entry : entries_of(folder)) {
        const std::string name = os::text_of(entry.filename());
        if (entry.extension() != ".tmp") continue;
        const std::size_t dash = name.rfind('-');
        const std::size_t dot = dash == std::string::npos ? dash : name.rfind('.', dash);
        if (dot == std::string::npos) continue;
        const int process = std::atoi(name.c_str() + dot + 1);
        std::error_code ignored;
        if (process > 0 && !os::may_run(process) && fs::last_write_time(entry, ignored) < newest)
            fs::remove(entry, ignored);
    }
}

void remove_stale_maps(const std::vector<MapJob>& jobs, const std::string& map,
                       const Shard& shard) {
    std::set<fs::path> folders;
    for (const MapJob& job : jobs) folders.insert(job.folder / os::path_of(map));
    for (const fs::path& folder : folders) remove_stale_files(folder, shard);
}

}  // namespace vkrun
