#include "vkrun/fit/video.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <optional>
#include <set>
#include <vector>

#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/progress.h"
#include "vkrun/cli/text.h"
#include "vkrun/fit/child_process.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

constexpr int kLongestSide = 1600;
constexpr std::uint64_t kFewestFrames = 10;
constexpr std::size_t kCells = 16;    ///< across a frame, whose means tell of motion
constexpr double kLeastMotion = 3.0;  ///< gray levels of a cell: above noise and flicker

struct Frame {
    std::uint64_t number = 0;
    std::uint32_t width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
    double sharpness = -1;
};

/// Gray values of a frame, 0 to 255.
std::vector<int> gray_of_frame(const Frame& frame) {
    std::vector<int> gray(frame.rgb.size() / 3);
    for (std::size_t i = 0; i < gray.size(); ++i)
        gray[i] = (2 * frame.rgb[3 * i] + 5 * frame.rgb[3 * i + 1] + frame.rgb[3 * i + 2]) / 8;
    return gray;
}

/// The variance of the Laplacian, four neighbours, over the inner pixels.
double sharpness_of(const Frame& frame, const std::vector<int>& gray) {
    double sum = 0, squares = 0;
    const std::size_t w = frame.width, h = frame.height;
    if (w < 3 || h < 3) return 0;
    for (std::size_t y = 1; y + 1 < h; ++y)
        for (std::size_t x = 1; x + 1 < w; ++x) {
            const int* at = &gray[y * w + x];
            const double value = at[-1] + at[1] + *(at - w) + at[w] - 4 * at[0];
            sum += value;
            squares += value * value;
        }
    const double count = static_cast<double>((w - 2) * (h - 2));
    return squares / count - sum / count * (sum / count);
}

/// Means over kCells x kCells cells.
std::vector<double> cells_of(const Frame& frame, const std::vector<int>& gray) {
    std::vector<double> sums(kCells * kCells), counts(kCells * kCells);
    for (std::size_t i = 0; i < gray.size(); ++i) {
        const std::size_t cell = i / frame.width * kCells / frame.height * kCells +
                                 i % frame.width * kCells / frame.width;
        sums[cell] += gray[i];
        counts[cell] += 1;
    }
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= std::max(counts[i], 1.0);
    return sums;
}

/// Takes the bytes of PPM pictures, one behind another, apart.
class PpmStream {
  public:
    explicit PpmStream(std::function<void(Frame&)> done) : done_(std::move(done)) {}

    void add(const char* bytes, std::size_t count) {
        while (count > 0) {
            if (frame_.rgb.empty()) {
                header_ += *bytes++;
                --count;
                if (std::count(header_.begin(), header_.end(), '\n') == 3) begin();
                continue;
            }
            const std::size_t part = std::min(count, frame_.rgb.size() - filled_);
            std::memcpy(frame_.rgb.data() + filled_, bytes, part);
            filled_ += part;
            bytes += part;
            count -= part;
            if (filled_ < frame_.rgb.size()) continue;
            done_(frame_);
            frame_.rgb.clear();
        }
    }

  private:
    void begin() {
        if (std::sscanf(header_.c_str(), "P6\n%u %u\n255\n", &frame_.width, &frame_.height) != 2 ||
            frame_.width == 0 || frame_.height == 0 ||
            std::max(frame_.width, frame_.height) > 2 * kLongestSide)
            throw Failure(kFailed, "ffmpeg did not write the pictures that it was asked for");
        frame_.rgb.resize(std::size_t{3} * frame_.width * frame_.height);
        filled_ = 0;
        header_.clear();
    }

    std::function<void(Frame&)> done_;
    std::string header_;
    Frame frame_;
    std::size_t filled_ = 0;
};

/// Keeps the sharpest frame of each part.
class SharpestFrames {
  public:
    SharpestFrames(fs::path folder, std::uint64_t frames, std::uint64_t wanted)
        : folder_(std::move(folder)),
          frames_(frames),
          parts_(std::min(frames, wanted)),
          progress_("frames", frames) {}

    void take(Frame& frame) {
        frame.number = ++seen_;
        const std::uint64_t part = std::min((frame.number - 1) * parts_ / frames_, parts_ - 1);
        if (part != part_) write();
        part_ = part;
        std::vector<int> gray = gray_of_frame(frame);
        frame.sharpness = sharpness_of(frame, gray);
        progress_.show(std::min(seen_, frames_));
        if (frame.sharpness <= best_.sharpness) return;
        std::swap(best_, frame);
        gray_ = std::move(gray);
    }
    void write() {
        if (best_.sharpness < 0) return;
        const std::vector<double> cells = cells_of(best_, gray_);
        if (first_.empty()) first_ = cells;
        for (std::size_t i = 0; i < cells.size(); ++i)
            motion_ = std::max(motion_, std::abs(cells[i] - first_[i]));
        const std::string name =
            format("frame_%06llu.png", static_cast<unsigned long long>(best_.number));
        const splat_image image = bytes_image(best_.rgb.data(), best_.width, best_.height, 3);
        check(splat_image_save(os::text_of(folder_ / os::path_of(name)).c_str(), &image));
        best_.sharpness = -1;
    }

    [[nodiscard]] std::uint64_t seen() const { return seen_; }
    [[nodiscard]] double motion() const { return motion_; }

  private:
    fs::path folder_;
    std::uint64_t frames_, parts_;
    std::uint64_t part_ = 0, seen_ = 0;
    Frame best_;
    std::vector<int> gray_;
    std::vector<double> first_;
    double motion_ = 0;  ///< largest difference of a cell from the first frame
    Progress progress_;
};

[[noreturn]] void refuse(const std::string& video, const std::string& sentence) {
    throw Failure(kBadData, "'" + video + "': " + sentence);
}

void check_installed(int status) {
    if (status == kNotInstalled)
        throw Failure(kFailed,
                      "ffmpeg and ffprobe, which read videos, are not installed: 'apt install "
                      "ffmpeg', 'brew install ffmpeg' or 'winget install ffmpeg'; or save the "
                      "video's frames as pictures and give their folder");
}

void check_count(const std::string& video, std::uint64_t frames) {
    if (frames < kFewestFrames)
        refuse(video, format("the video is too short: %llu frames, expected %llu or more; film for "
                             "20 to 60 s, slowly around the scene",
                             static_cast<unsigned long long>(frames),
                             static_cast<unsigned long long>(kFewestFrames)));
}

/// Decodes a video of about this many frames.
void decode(const std::string& video, const std::string& log, SharpestFrames& sharpest) {
    PpmStream stream([&](Frame& frame) { sharpest.take(frame); });
    std::string last;
    // Even times keep ffmpeg from leaving out or repeating frames.
    const std::string filter = format(
        "settb=1/25,setpts=N,scale='if(gt(iw,ih),min(%d,iw),-2)':'if(gt(iw,ih),-2,min(%d,ih))'",
        kLongestSide, kLongestSide);
    const int status = run_child(
        {"ffmpeg", "-v", "error", "-nostdin", "-i", "file:" + video, "-map", "0:v:0", "-vf", filter,
         "-r", "25", "-f", "image2pipe", "-c:v", "ppm", "-pix_fmt", "rgb24", "pipe:1"},
        {[&](const std::string& line) { last = line; },
         [&](const char* bytes, std::size_t count) { stream.add(bytes, count); }, log});
    check_installed(status);
    if (status != 0 && sharpest.seen() == 0) refuse(video, "ffmpeg cannot decode it: " + last);
    if (status != 0)
        std::fprintf(stderr, "vkrun: warning: '%s': ffmpeg stopped after %llu frames: %s\n",
                     video.c_str(), static_cast<unsigned long long>(sharpest.seen()), last.c_str());
    sharpest.write();
}

}  // namespace

bool is_video(const fs::path& path) {
    static const std::set<std::string> extensions = {
        ".mp4", ".m4v",  ".mov", ".mkv", ".avi", ".webm", ".mpg", ".mpeg",
        ".3gp", ".m2ts", ".mts", ".ts",  ".wmv", ".ogv",  ".flv", ".gif"};
    return extensions.contains(extension_of(path));
}

std::uint64_t count_frames(const std::string& video) {
    std::string last;
    std::optional<std::uint64_t> frames;
    const int status = run_child(
        {"ffprobe", "-v", "error", "-select_streams", "v:0", "-count_packets", "-show_entries",
         "stream=nb_read_packets", "-of", "default=noprint_wrappers=1", "file:" + video},
        {[&](const std::string& line) {
             unsigned long long count = 0;
             if (std::sscanf(line.c_str(), "nb_read_packets=%llu", &count) == 1)
                 frames = count;
             else
                 last = line;
         },
         {},
         {}});
    check_installed(status);
    if (status != 0) refuse(video, "ffprobe cannot read it: " + last);
    if (!frames)
        refuse(video, "the file has no video stream; give a video, or a folder of photographs");
    check_count(video, *frames);
    return *frames;
}

void extract_frames(const std::string& video, std::uint64_t frames, const fs::path& folder,
                    std::uint32_t wanted, const std::string& log) {
    const auto count = static_cast<unsigned long long>(frames);
    if (frames > wanted)
        std::fprintf(stderr, "of %llu frames the sharpest of every %.3g is taken", count,
                     static_cast<double>(frames) / wanted);
    else
        std::fprintf(stderr, "all %llu frames are taken", count);
    std::fprintf(stderr, ", at most %d pixels a side\n", kLongestSide);
    const fs::path part = os::path_of(os::text_of(folder) + ".part");
    fs::remove_all(part);
    make_folder(part);
    SharpestFrames sharpest(part, frames, wanted);
    decode(video, log, sharpest);
    check_count(video, sharpest.seen());
    if (sharpest.motion() < kLeastMotion)
        refuse(video,
               format("the video has no motion: its frames differ by %.2g gray levels at most; "
                      "cameras are found by what moves as the camera walks around the scene",
                      sharpest.motion()));
    fs::remove_all(folder);
    fs::rename(part, folder);
}

}  // namespace vkrun
