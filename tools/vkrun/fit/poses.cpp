#include "vkrun/fit/poses.h"

#include <array>
#include <cstdio>
#include <fstream>
#include <functional>
#include <optional>

#include "core/os/console.h"
#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/text.h"
#include "vkrun/fit/child_process.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

constexpr std::size_t kMostPairwise = 200;  ///< photographs of which all pairs are matched

// COLMAP's matcher compares all features of two photographs: 50 photographs of 4,400 features were not matched by two
// cores in 25 minutes, and took 2 with 2,048. A block of pairs that is done stays done after an interruption.
constexpr const char* kMostFeatures = "2048";
constexpr const char* kBlock = "10";

/// A line on standard error that a terminal replaces, and a log gets at each tenth.
class StageLine {
  public:
    StageLine(std::string what, std::size_t total) : what_(std::move(what)), total_(total) {}
    ~StageLine() {
        if (terminal_ && shown_) std::fputc('\n', stderr);
    }
    StageLine(const StageLine&) = delete;
    StageLine& operator=(const StageLine&) = delete;

    void show(std::size_t done, std::size_t total = 0) {
        if (total != 0) total_ = total;
        const std::size_t tenth = 10 * done / std::max<std::size_t>(total_, 1);
        if (!terminal_ && (tenth <= tenth_ || done > total_)) return;
        tenth_ = tenth;
        shown_ = true;
        std::fprintf(stderr, "%scolmap: %s %zu of %zu%s", terminal_ ? "\r" : "", what_.c_str(),
                     done, total_, terminal_ ? "\033[K" : "\n");
        std::fflush(stderr);
    }

  private:
    std::string what_;
    std::size_t total_, tenth_ = 0;
    bool terminal_ = os::errors_on_terminal(), shown_ = false;
};

/// The numbers behind the last '[' of a line as "[3/50]".
std::optional<std::pair<std::size_t, std::size_t>> counts_of(const std::string& line) {
    const std::size_t at = line.rfind('[');
    std::size_t done = 0, total = 0;
    if (at == std::string::npos || std::sscanf(line.c_str() + at, "[%zu/%zu", &done, &total) != 2)
        return {};
    return std::pair(done, total);
}

/// How many photographs have a place when the mapper says "Registering image #12 (23)", in newer versions
/// "(num_reg_frames=23)".
std::optional<std::size_t> registered_of(const std::string& line) {
    if (line.find("Registering image") == std::string::npos) return {};
    const std::size_t open = line.rfind('(');
    const std::size_t digit = line.find_first_of("0123456789", open);
    if (open == std::string::npos || digit == std::string::npos) return {};
    return std::strtoull(line.c_str() + digit, nullptr, 10);
}

class Colmap {
  public:
    explicit Colmap(const PoseTask& task)
        : task_(task), database_(os::text_of(task.work / "database.db")) {}

    Poses run() {
        make_folder(task_.work);
        const std::string list = os::text_of(task_.work / "images.txt");
        std::string names;
        for (const std::string& name : task_.names) names += name + "\n";
        replace_file(list, names);
        extract(list);
        match();
        map();
        Poses poses = largest();
        if (status_ != 0 && poses.registered == 0 && !no_pair_) fail("mapper");
        return poses;
    }

  private:
    /// "--GROUP.use_gpu" with the group that this version has: the newer one, or the older.
    std::string gpu_option(const std::string& command, const std::string& newer,
                           const std::string& older) {
        bool has_newer = false;
        const std::string option = newer + ".use_gpu";
        run_child({"colmap", command, "--help"},
                  {[&](const std::string& line) {
                       has_newer = has_newer || line.find(option) != std::string::npos;
                   },
                   {},
                   {}});
        return "--" + (has_newer ? newer : older) + ".use_gpu";
    }

    /// Runs a command; false if it fails.
    bool run(const std::vector<std::string>& words,
             const std::function<void(const std::string&)>& line) {
        std::vector<std::string> all = {"colmap"};
        all.insert(all.end(), words.begin(), words.end());
        const auto seen = [&](const std::string& text) {
            if (text.find_first_not_of(" =") != std::string::npos) last_ = text;
            line(text);
        };
        status_ = run_child(all, {seen, {}, task_.log});
        return status_ == 0;
    }

    [[noreturn]] void fail(const std::string& command) const {
        throw Failure(kFailed, format("colmap %s failed with status %d: %s; '%s' has all that it "
                                      "said",
                                      command.c_str(), status_, last_.c_str(), task_.log.c_str()));
    }

    void extract(const std::string& list) {
        StageLine stage("features of", task_.names.size());
        // A video is often one orbit, which does not determine OPENCV's tangential terms: 90 renders had p1 = -0.07 and
        // 19.4 dB held out by it, 34.3 dB by SIMPLE_RADIAL.
        const bool plain = task_.ordered || !task_.one_camera;
        const char* lens = plain ? "SIMPLE_RADIAL" : "OPENCV";
        std::vector<std::string> words = {"feature_extractor",
                                          "--database_path",
                                          database_,
                                          "--image_path",
                                          os::text_of(task_.photos),
                                          "--image_list_path",
                                          list,
                                          "--ImageReader.single_camera",
                                          task_.one_camera ? "1" : "0",
                                          "--ImageReader.camera_model",
                                          lens};
        words.push_back(gpu_option("feature_extractor", "FeatureExtraction", "SiftExtraction"));
        words.insert(words.end(), {"0", "--SiftExtraction.max_num_features", kMostFeatures});
        const bool done = run(words, [&](const std::string& line) {
            const auto counts = counts_of(line);
            if (counts && line.find("Processed file") != std::string::npos)
                stage.show(counts->first, counts->second);
        });
        if (!done) fail("feature_extractor");
    }

    void match() {
        const bool pairwise = !task_.ordered && task_.names.size() <= kMostPairwise;
        if (!pairwise && !task_.ordered)
            std::fprintf(stderr,
                         "more than %zu photographs: each is matched with its neighbours by name\n",
                         kMostPairwise);
        const std::string command = pairwise ? "exhaustive_matcher" : "sequential_matcher";
        StageLine stage(pairwise ? "matched rows of blocks" : "matched", 1);
        std::vector<std::string> words = {command, "--database_path", database_,
                                          gpu_option(command, "FeatureMatching", "SiftMatching"),
                                          "0"};
        if (pairwise) words.insert(words.end(), {"--ExhaustiveMatching.block_size", kBlock});
        const bool done = run(words, [&](const std::string& line) {
            const auto counts = counts_of(line);
            if (counts && (line.find("Matching ") != std::string::npos ||
                           line.find("Processing ") != std::string::npos))
                stage.show(counts->first, counts->second);
        });
        if (!done) fail(command);
    }

    void map() {
        const fs::path out = task_.work / "sparse";
        fs::remove_all(out);
        make_folder(out);
        StageLine stage("registered", task_.names.size());
        run({"mapper", "--database_path", database_, "--image_path", os::text_of(task_.photos),
             "--output_path", os::text_of(out)},
            [&](const std::string& line) {
                if (const auto count = registered_of(line)) stage.show(*count);
                // The mapper fails then, which the count of photographs tells better.
                for (const char* none : {"No good initial image pair", "No images with matches"})
                    no_pair_ = no_pair_ || line.find(none) != std::string::npos;
            });
        if (status_ > 128 || status_ == kNotInstalled) fail("mapper");
    }

    [[nodiscard]] Poses largest() const {
        Poses found;
        for (const fs::directory_entry& entry : fs::directory_iterator(task_.work / "sparse")) {
            std::array<unsigned char, 8> bytes{};
            std::ifstream file(entry.path() / "images.bin", std::ios::binary);
            if (!file.read(reinterpret_cast<char*>(bytes.data()), bytes.size())) continue;
            std::size_t count = 0;
            for (std::size_t i = bytes.size(); i-- > 0;) count = count << 8U | bytes[i];
            ++found.models;
            if (count < found.registered ||
                (count == found.registered && os::text_of(found.model) < os::text_of(entry.path())))
                continue;
            found.registered = count;
            found.model = entry.path();
        }
        return found;
    }

    const PoseTask& task_;
    std::string database_;
    std::string last_;
    int status_ = 0;
    bool no_pair_ = false;
};

}  // namespace

void check_colmap() {
    if (run_child({"colmap", "help"}, {}) == kNotInstalled)
        throw Failure(kFailed,
                      "COLMAP, which finds the cameras of photographs, is not installed: "
                      "'apt install colmap' or 'brew install colmap', on Windows the release "
                      "of github.com/colmap/colmap, with its folder bin in PATH; or put a "
                      "transforms.json with the cameras "
                      "beside the photographs");
}

Poses find_poses(const PoseTask& task) {
    return Colmap(task).run();
}

}  // namespace vkrun
