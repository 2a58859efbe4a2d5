#include "vkrun/fit/unposed.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <set>
#include <vector>

#include "core/os/console.h"
#include "core/os/file.h"
#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"
#include "vkrun/fit/object.h"
#include "vkrun/fit/poses.h"
#include "vkrun/fit/video.h"
#include "vkrun/scene/camera_file.h"
#include "vkrun/train/run_signals.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

constexpr std::size_t kFewestPhotos = 3;
constexpr const char* kMade[] = {"data", "masks", "colmap", "photos", "colmap.log", "ffmpeg.log"};

bool has(const fs::path& path) {
    std::error_code none;
    return fs::exists(path, none);
}

/// Whether a folder holds a run, as the library sees it.
bool holds_run(const fs::path& out) {
    return has(out / "config.json") && (has(out / "lock") || has(out / "run.json"));
}

/// Names of files in a folder with one of the extensions, in order.
std::vector<std::string> names_with(const fs::path& folder, const std::set<std::string>& endings) {
    std::vector<std::string> names;
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, none))
        if (const std::string name = os::text_of(entry.path().filename());
            name[0] != '.' && endings.contains(extension_of(name)))
            names.push_back(name);
    std::sort(names.begin(), names.end());
    return names;
}

std::vector<std::string> photos_in(const fs::path& folder) {
    return names_with(folder, {".png", ".jpg", ".jpeg", ".webp", ".pgm", ".ppm"});
}

std::vector<std::string> others_in(const fs::path& folder) {
    return names_with(folder, {".heic", ".heif", ".avif", ".tif", ".tiff", ".jxl", ".dng"});
}

/// The folder of the photographs of DATA: images/ if it has some, else DATA.
fs::path photos_of(const fs::path& data) {
    return photos_in(data / "images").empty() && others_in(data / "images").empty()
               ? data
               : data / "images";
}

/// Whether a folder has a file of cameras, as the library looks for them.
bool has_cameras(const fs::path& data) {
    for (const char* folder : {"", "sparse/0", "sparse"})
        for (const char* file : {"cameras.bin", "cameras.txt", "images.bin", "images.txt"})
            if (has(data / folder / file)) return true;
    const auto found = names_with(data, {".json"});
    return std::any_of(found.begin(), found.end(),
                       [](const std::string& name) { return name.starts_with("transforms"); });
}

/// Throws where no photograph can be read; says which are left out.
void check_formats(const fs::path& folder, std::size_t readable) {
    const std::vector<std::string> others = others_in(folder);
    if (others.empty()) return;
    const std::string found = format(
        "'%s': %zu photographs are HEIC, TIFF or of another format that is not read, such as '%s'",
        os::text_of(folder).c_str(), others.size(), others[0].c_str());
    const char* const advice =
        "convert them: 'heif-convert IN.heic OUT.jpg', or 'magick IN OUT.jpg'";
    if (readable < kFewestPhotos) throw Failure(kBadData, found + "; " + advice);
    std::fprintf(stderr, "vkrun: warning: %s, and are left out; %s\n", found.c_str(), advice);
}

/// What prepared.json holds.
class Record {
  public:
    explicit Record(const std::string& out) : path_(os::path_of(out) / "prepared.json") {
        if (has(path_)) json_ = Json::parse(read_text(os::text_of(path_)), nullptr, false);
        if (!json_.is_object()) json_ = Json::object();
    }
    [[nodiscard]] bool is_there() const { return !json_.empty(); }
    [[nodiscard]] Json what() const { return json_.value("what", Json::object()); }
    [[nodiscard]] bool object() const { return json_.value("object", false); }
    [[nodiscard]] bool is_done(const char* stage) const {
        const Json done = json_.value("done", Json::array());
        return std::find(done.begin(), done.end(), stage) != done.end();
    }
    /// Removes what was made of other input, and what makes the folder that of an old run.
    void begin(const Json& what, bool object) {
        const fs::path out = path_.parent_path();
        if (this->what() != what) {
            for (const char* name : kMade) fs::remove_all(out / name);
            json_ = {{"what", what}, {"done", Json::array()}};
        }
        set_object(object);
        for (const char* name : {"config.json", "run.json"}) fs::remove(out / name);
    }
    void set_object(bool object) {
        json_["object"] = object;
        save();
    }
    void finish(const char* stage) {
        if (!is_done(stage)) json_["done"].push_back(stage);
        save();
    }

  private:
    void save() const { replace_file(path_, json_text(json_) + "\n"); }

    fs::path path_;
    Json json_;
};

/// The lock of a run's folder, while its input is made.
class FolderLock {
  public:
    explicit FolderLock(const std::string& out) {
        make_folder(out);
        const std::string path = os::text_of(os::path_of(out) / "lock");
        file_ = os::open(path, os::Open::kUpdate);
        if (file_ == os::kNoHandle) throw Failure(kFailed, "cannot write '" + path + "'");
        if (os::lock(file_, os::Lock::kExclusive, false) == 0) return;
        os::close(file_);
        throw Failure(kUsageError, "'" + out +
                                       "' is in use: wait for the end of the fit there, "
                                       "stop it, or choose another folder");
    }
    ~FolderLock() { os::close(file_); }
    FolderLock(const FolderLock&) = delete;
    FolderLock& operator=(const FolderLock&) = delete;

  private:
    os::Handle file_ = os::kNoHandle;
};

class Preparation {
  public:
    Preparation(FitInput& input, Record& record)
        : input_(input),
          record_(record),
          out_(fs::absolute(os::path_of(input.out)).lexically_normal()) {}

    /// Data with cameras, made of photographs, or of a video of so many frames.
    void make_poses(const fs::path& source, bool video, std::uint64_t frames) {
        fs::path photos = video ? out_ / "photos" : source;
        const std::string log = os::text_of(out_ / "colmap.log");
        if (video && !record_.is_done("frames")) {
            extract_frames(os::text_of(source), frames, photos, input_.frames,
                           os::text_of(out_ / "ffmpeg.log"));
            record_.finish("frames");
        }
        const std::vector<std::string> names = photos_in(photos);
        if (!record_.is_done("poses")) {
            PoseTask task{photos,          names, video, video || have_one_size(photos, names),
                          out_ / "colmap", log};
            if (task.one_camera && !video)
                std::fprintf(stderr,
                             "the photographs have one size: taken for those of one lens\n");
            const Poses poses = find_poses(task);
            lay_out(poses, photos);
            check_count(poses, names.size());
            record_.finish("poses");
        }
        input_.data = os::text_of(os::path_of(input_.out) / "data");
    }

    void make_masks() {
        if (!input_.object || !input_.masks.empty()) return;
        // Masks that are made stay, so a signal may end it at once.
        os::release_interrupts();
        input_.masks = make_object_masks(os::text_of(photos_of(os::path_of(input_.data))),
                                         input_.out, input_.overwrite);
    }

  private:
    static bool have_one_size(const fs::path& folder, const std::vector<std::string>& names) {
        std::set<std::pair<std::uint32_t, std::uint32_t>> sizes;
        for (const std::string& name : names) {
            splat_image image{};
            image.type = SPLAT_PIXEL_U8;
            check(
                splat_image_load(os::text_of(folder / os::path_of(name)).c_str(), &image, nullptr),
                kBadData);
            sizes.emplace(image.width, image.height);
        }
        return sizes.size() == 1;
    }

    /// Where links to folders cannot be made, such as by most users of Windows: other names of the photographs, or
    /// copies on another disk.
    static void link_photos(const fs::path& from, const fs::path& to) {
        make_folder(to);
        for (const std::string& text : photos_in(from)) {
            const fs::path name = os::path_of(text);
            std::error_code failed;
            fs::create_hard_link(from / name, to / name, failed);
            if (failed) fs::copy_file(from / name, to / name);
        }
    }

    /// data/ with the model, whole or not at all.
    void lay_out(const Poses& poses, const fs::path& photos) const {
        const fs::path data = out_ / "data", part = out_ / "data_part";
        fs::remove_all(part);
        fs::remove_all(data);
        if (poses.registered == 0) return;
        make_folder(part / "sparse");
        fs::copy(poses.model, part / "sparse" / "0");
        const bool inside = photos.parent_path() == out_;
        std::error_code failed;
        fs::create_directory_symlink(inside ? ".." / photos.filename() : photos, part / "images",
                                     failed);
        if (failed) link_photos(photos, part / "images");
        fs::rename(part, data);
    }

    void check_count(const Poses& poses, std::size_t count) const {
        std::fprintf(stderr, "colmap: %zu of %zu photographs have a place\n", poses.registered,
                     count);
        if (poses.registered >= kFewestPhotos && 2 * poses.registered >= count) return;
        std::string sentence = format(
            "COLMAP found a place for %zu of %zu photographs only: the others share too little "
            "with "
            "them, are blurred, or show plain, shiny or moving things; take more, each of which "
            "shows two thirds of what the one before does, walk around the scene instead of "
            "turning "
            "on the spot, and repeat the command with them",
            poses.registered, count);
        if (poses.registered >= kFewestPhotos)
            sentence += "; 'vkrun fit " + os::text_of(out_ / "data") +
                        " --out DIR' fits those that have one";
        throw Failure(kBadData, sentence);
    }

    FitInput& input_;
    Record& record_;
    fs::path out_;
};

/// Identifies the photographs or the video: their names, sizes and times.
Json what_of(const fs::path& source, const std::vector<std::string>& names, const FitInput& input) {
    Json what = {{"source", os::text_of(source)}};
    std::error_code none;
    const auto time_of = [&](const fs::path& path) {
        return std::chrono::duration_cast<std::chrono::seconds>(
                   fs::last_write_time(path, none).time_since_epoch())
            .count();
    };
    if (names.empty()) {
        what["bytes"] = fs::file_size(source, none);
        what["modified"] = time_of(source);
        what["frames"] = input.frames;
    }
    for (const std::string& name : names)
        what["photos"].push_back({name, fs::file_size(source / os::path_of(name), none),
                                  time_of(source / os::path_of(name))});
    return what;
}

/// Throws where the library would refuse OUT after everything is made, or where OUT has files of others.
void check_out(const FitInput& input, const Record& record) {
    const fs::path out = os::path_of(input.out);
    const std::string place = "'" + input.out + "' is there and ";
    const bool is_run = holds_run(out);
    if (is_run && !input.overwrite)
        throw Failure(kUsageError,
                      place + "holds a run: --resume it, --overwrite it, or choose another folder");
    if (record.is_there() || !has(out)) return;
    std::error_code none;
    if (!is_run && !fs::is_empty(out, none))
        throw Failure(kUsageError, place + "is not a run: choose another folder");
    for (const char* name : kMade)
        if (has(out / name))
            throw Failure(kUsageError, place + "has '" + name +
                                           "' already, which this command "
                                           "makes: choose another folder");
}

/// Throws where input lies in what is removed for it.
void check_kept(const FitInput& input, const fs::path& source) {
    const auto whole = [](const fs::path& path) {
        return fs::weakly_canonical(fs::absolute(path));
    };
    for (const fs::path& path : {os::path_of(input.data), source, os::path_of(input.masks)}) {
        if (path.empty()) continue;
        const fs::path below = whole(path).lexically_relative(whole(os::path_of(input.out)));
        for (const char* name : kMade)
            if (!below.empty() && *below.begin() == name)
                throw Failure(kUsageError, "'" + os::text_of(path) + "' lies in '" + input.out +
                                               "', where this command makes '" + name +
                                               "' anew: choose another folder");
    }
}

/// Throws for options that such input does not have.
void check_options(const FitInput& input, bool video) {
    if (input.frames_given && !video)
        throw Failure(kUsageError, "--frames is for a video, and '" + input.data + "' is none");
    if (video && input.cameras == "transforms")
        throw Failure(kUsageError,
                      "--cameras is 'transforms', which a video has none of: leave it out");
}

/// Throws where photographs with cameras lie in other folders than that of which masks are made.
void check_together(const FitInput& input, const std::vector<std::string>& photos) {
    bool together = !photos.empty();
    try {
        const CameraFile file =
            load_cameras(cameras_in(input.data, input.cameras == "transforms"),
                         {.size = {}, .ignore_distortion = true, .without_size = true});
        for (const std::string& text : file.names) {
            fs::path name = os::path_of(text).lexically_normal();
            if (!name.empty() && *name.begin() == "images")
                name = name.lexically_relative("images");
            together = together && !name.has_parent_path();
        }
    } catch (const Failure&) {  // the fit has its sentence
        return;
    }
    if (!together)
        throw Failure(kUsageError, "--object makes masks of photographs in '" + input.data +
                                       "' or its images/, but they lie in other folders: give "
                                       "--masks");
}

/// Whether a run that has begun is resumed, so that no more is to do.
bool is_begun(FitInput& input, const Record& record) {
    if (!input.resume) return false;
    if (record.is_there() && !holds_run(os::path_of(input.out)))
        throw Failure(kUsageError, "'" + input.out +
                                       "' has what a run is made of, but no run yet: repeat the "
                                       "command without --resume; what is done stays done");
    if (input.object && !record.object())
        throw Failure(kUsageError, "--object belongs to the beginning of a run: begin a new one");
    if (!record.is_there()) return true;
    input.object = record.object();
    const std::string source = record.what().value("source", "");
    const fs::path data = fs::weakly_canonical(os::path_of(input.data));
    if (data == os::path_of(source) || photos_of(data) == os::path_of(source)) input.data.clear();
    return true;
}

}  // namespace

std::string photos_of(const std::string& data) {
    return os::text_of(photos_of(os::path_of(data)));
}

void prepare_input(FitInput& input) {
    Record record(input.out);
    if (is_begun(input, record) || input.data.empty()) return;
    const fs::path data = fs::weakly_canonical(os::path_of(input.data));
    const bool video = is_video(data) && fs::is_regular_file(data);
    const fs::path source = video ? data : photos_of(data);
    const std::vector<std::string> names = video ? std::vector<std::string>() : photos_in(source);
    const bool asks = input.cameras.empty() || input.cameras == "auto";
    check_options(input, video);
    bool unposed = video;
    if (!video && fs::is_directory(data) && asks && !has_cameras(data)) {
        check_formats(source, names.size());
        unposed = !names.empty();
    }
    if (!unposed && (!input.object || !fs::is_directory(data))) return;
    if (!unposed && input.masks.empty()) check_together(input, names);
    check_out(input, record);
    const Json what = what_of(source, names, input);
    if (record.what() != what) check_kept(input, source);
    const bool has_poses = record.what() == what && record.is_done("poses");
    std::uint64_t frames = 0;
    catch_run_signals();
    if (video && !(record.what() == what && record.is_done("frames")))
        frames = count_frames(os::text_of(source));
    if (unposed && !has_poses) check_colmap();
    const FolderLock lock(input.out);
    record.begin(what, input.object);
    Preparation preparation(input, record);
    if (unposed) preparation.make_poses(source, video, frames);
    preparation.make_masks();
}

void note_begun(const FitInput& input) {
    Record record(input.out);
    if (record.is_there() && record.object() != input.object) record.set_object(input.object);
}

}  // namespace vkrun
