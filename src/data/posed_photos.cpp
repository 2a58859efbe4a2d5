#include "data/posed_photos.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <set>

#include "core/os/path.h"
#include "core/parallel.h"
#include "core/path_name.h"
#include "core/shown.h"
#include "data/folder.h"
#include "data/formats.h"
#include "data/image_folder.h"
#include "data/map_files.h"
#include "io/colmap.h"
#include "io/file.h"
#include "io/mesh/mesh.h"
#include "scene/camera_pose.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

using Cameras = PosedPhotosOptions::Cameras;

constexpr double kFarthest =
    1e4;  ///< distance of a point; 1: that of the cameras from their middle

/// A camera with its files.
struct ListedPhoto {
    scene::Camera camera;
    scene::Lens lens;
    std::string mask;  ///< mask_path, then its path; empty: none
    std::string path;
    bool held_out = false;
};

/// A name without "./" and "images/" before it, as it is below a folder beside images/.
std::string name_below_images(const std::string& name) {
    const fs::path path = os::path_of(name).lexically_normal();
    const bool below = !path.empty() && *path.begin() == "images";
    return os::text_of(below ? path.lexically_relative("images") : path);
}

/// The first file of a path with one of the endings; empty if there is none.
Result<std::string> file_at(const fs::path& path, std::initializer_list<const char*> endings) {
    for (const char* ending : endings) {
        std::string found = os::text_of(path) + ending;
        SPLAT_ASSIGN(const bool is_there, io::has_file(found));
        if (is_there) return found;
    }
    return std::string();
}

class PhotoLoader {
  public:
    PhotoLoader(const std::string& folder, const PosedPhotosOptions& options)
        : folder_(os::path_of(folder)),
          options_(options),
          factor_(std::max(options.downscale, std::uint32_t{1})) {}

    Result<PosedPhotos> load() {
        SPLAT_TRY(find_cameras());
        for (const ListedPhoto& photo : listed_)
            for (const std::string& name : {photo.camera.name, photo.mask})
                SPLAT_TRY(in_file(check_portable(name), os::text_of(folder_)));
        std::ranges::stable_sort(listed_, {},
                                 [](const ListedPhoto& photo) { return photo.camera.name; });
        hold_out();
        SPLAT_TRY(check_count());
        SPLAT_TRY(find_photographs());
        SPLAT_TRY(find_masks());
        SPLAT_TRY(find_maps());
        SPLAT_TRY(keep_points());
        SPLAT_TRY(read_photographs());
        SPLAT_TRY(check_colors());
        return std::move(result_);
    }

  private:
    void notice(const std::string& sentence) { result_.notices.push_back(sentence); }

    [[nodiscard]] Status no_cameras() const {
        const std::string path = os::text_of(folder_);
        const std::string lack = lack_of_cameras(path);
        return not_found(
            "%s; 'colmap automatic_reconstructor --workspace_path %s --image_path %s/images' makes "
            "cameras for photographs",
            lack.empty() ? format("'%s' has no cameras: neither a COLMAP model (cameras.bin or "
                                  "cameras.txt, also in sparse/0 or sparse) nor transforms.json",
                                  path.c_str())
                               .c_str()
                         : lack.c_str(),
            path.c_str(), path.c_str());
    }

    Status find_cameras() {
        SPLAT_ASSIGN(const io::PathKind kind, io::kind_of(os::text_of(folder_)));
        if (kind != io::PathKind::kFolder)
            return not_found("'%s' is no folder, expected one of photographs with cameras",
                             os::text_of(folder_).c_str());
        std::string model;
        if (options_.cameras != Cameras::kTransforms)
            SPLAT_SET(model, io::find_colmap(os::text_of(folder_)));
        std::vector<fs::path> files;
        if (options_.cameras != Cameras::kColmap)
            for (const char* name : {"transforms.json", "transforms_train.json",
                                     "transforms_val.json", "transforms_test.json"}) {
                SPLAT_ASSIGN(const bool is_there, io::has_file(os::text_of(folder_ / name)));
                if (is_there) files.push_back(folder_ / name);
                if (is_there && files.size() == 1 && name == std::string("transforms.json")) break;
            }
        if (!model.empty()) return use_colmap(model, !files.empty());
        if (files.empty()) return no_cameras();
        return files[0].filename() == "transforms.json" ? use_transforms(files[0])
                                                        : use_split_transforms(files);
    }

    Status use_colmap(const std::string& model, bool has_transforms) {
        SPLAT_ASSIGN(const io::CameraSet set,
                     io::load_colmap(os::text_of(folder_), {.keep_lens = true}));
        for (std::size_t i = 0; i < set.cameras.size(); ++i)
            listed_.push_back({set.cameras[i], set.lenses[i], {}, {}, false});
        SPLAT_ASSIGN(points_, io::load_colmap_points(os::text_of(folder_)));
        notice(format("the cameras are those of the COLMAP model '%s'%s",
                      os::text_of(os::path_of(model).lexically_relative(folder_)).c_str(),
                      has_transforms ? "; transforms.json is not read" : ""));
        return {};
    }

    /// Adds the cameras of a file, and its points.
    Result<io::CameraSet> add_transforms(const fs::path& file) {
        SPLAT_ASSIGN(io::CameraSet set, load_transforms(folder_, file, {.keep_lens = true}));
        for (std::size_t i = 0; i < set.cameras.size(); ++i)
            listed_.push_back({set.cameras[i], set.lenses[i], set.maps[i].mask, {}, false});
        for (const std::string& warning : set.warnings) notice(warning);
        if (set.points.empty()) return set;
        SPLAT_TRY(in_file(check_portable(set.points), os::text_of(file)));
        const std::string path = os::text_of(folder_ / set.points);
        SPLAT_ASSIGN(const bool is_there, io::has_file(path));
        if (!is_there) {
            notice(format("there is no '%s', which ply_file_path names", path.c_str()));
            return set;
        }
        SPLAT_ASSIGN(const io::Buffer bytes, io::read_file(path));
        SPLAT_ASSIGN(points_, in_file(io::read_ply_colored_points(bytes), path));
        return set;
    }

    Status use_transforms(const fs::path& file) {
        SPLAT_ASSIGN(const io::CameraSet set, add_transforms(file));
        notice(format("the cameras are those of '%s'", os::text_of(file.filename()).c_str()));
        const auto names = [&set](const char* split) {
            const auto found = set.splits.find(split);
            return found == set.splits.end()
                       ? std::set<std::string>()
                       : std::set<std::string>(found->second.begin(), found->second.end());
        };
        const std::set<std::string> train = names("train");
        std::set<std::string> test = names("test");
        if (test.empty()) test = names("val");
        std::set<std::string> all = train;
        all.insert(test.begin(), test.end());
        for (const ListedPhoto& photo : listed_) all.erase(photo.camera.name);
        if (!all.empty())
            return damaged("'%s': a split names '%s', which no frame has",
                           os::text_of(file).c_str(), shown(*all.begin()).c_str());
        for (ListedPhoto& photo : listed_) photo.held_out = test.contains(photo.camera.name);
        const std::size_t others = std::erase_if(listed_, [&](const ListedPhoto& photo) {
            return !photo.held_out && !train.empty() && !train.contains(photo.camera.name);
        });
        if (others > 0)
            notice(format("%zu frames are in no split that is used, and left out", others));
        return {};
    }

    /// Uses transforms_{train,val,test}.json: the first of them to fit, the last to score.
    Status use_split_transforms(const std::vector<fs::path>& files) {
        SPLAT_TRY(add_transforms(files.front()).status());
        const std::size_t fitted = listed_.size();
        if (files.size() > 1) SPLAT_TRY(add_transforms(files.back()).status());
        for (std::size_t i = fitted; i < listed_.size(); ++i) listed_[i].held_out = true;
        const std::string last = os::text_of(files.back().filename());
        const std::string scored = files.size() > 1 ? ", and to score '" + last + "'" : "";
        notice("the cameras are those of '" + os::text_of(files.front().filename()) + "'" + scored);
        return {};
    }

    void hold_out() {
        const auto held = [this] {
            return static_cast<std::size_t>(std::ranges::count_if(listed_, &ListedPhoto::held_out));
        };
        const bool own = held() > 0;
        if (options_.test_every == 0) {
            for (ListedPhoto& photo : listed_) photo.held_out = false;
            if (own) notice("the data's own split is not used: all photographs are fitted");
            return;
        }
        if (!own)
            for (std::size_t i = 0; i < listed_.size(); i += options_.test_every)
                listed_[i].held_out = true;
        if (held() > 0)
            notice(format("%zu of %zu photographs are held out: %s", held(), listed_.size(),
                          own ? "those of the data's own split"
                              : format("1 of %u by name", options_.test_every).c_str()));
    }

    [[nodiscard]] Status check_count() const {
        const auto fitted = std::ranges::count_if(
            listed_, [](const ListedPhoto& photo) { return !photo.held_out; });
        if (fitted >= 2) return {};
        return invalid(
            "'%s': %td of %zu photographs are left to fit, expected at least 2, better 20 or more "
            "from all around%s",
            os::text_of(folder_).c_str(), fitted, listed_.size(),
            fitted < std::ssize(listed_) ? "; hold none out to fit them all" : "");
    }

    /// Sets the paths to photographs in images_D/; false if it lacks some.
    Result<bool> find_reduced() {
        const std::string name = "images_" + std::to_string(factor_);
        SPLAT_ASSIGN(const io::PathKind kind, io::kind_of(os::text_of(folder_ / name)));
        if (factor_ == 1 || kind != io::PathKind::kFolder) return false;
        for (ListedPhoto& photo : listed_) {
            const fs::path path = folder_ / name / name_below_images(photo.camera.name);
            SPLAT_SET(photo.path, file_at(path, {"", ".png", ".jpg", ".jpeg", ".webp"}));
            if (!photo.path.empty()) continue;
            notice(format("'%s' lacks '%s': photographs of full size are reduced instead",
                          name.c_str(), shown(photo.camera.name).c_str()));
            return false;
        }
        notice("the photographs are those of '" + name + "'");
        return true;
    }

    Status find_photographs() {
        SPLAT_ASSIGN(is_reduced_, find_reduced());
        if (is_reduced_) return {};
        std::vector<std::string> missing;
        std::set<std::string> used;
        for (ListedPhoto& photo : listed_) {
            auto path = image_path(folder_, photo.camera.name);
            if (path.status().code() == Code::kNotFound)
                missing.push_back(photo.camera.name);
            else if (!path.ok())
                return path.status();
            else
                photo.path = path.value();
            used.insert(os::text_of(os::path_of(photo.path).filename()));
        }
        if (!missing.empty())
            return not_found(
                "'%s': %zu of %zu photographs are missing, such as '%s', here or in images/; put "
                "them there under the names that the cameras have",
                os::text_of(folder_).c_str(), missing.size(), listed_.size(),
                shown(missing[0]).c_str());
        SPLAT_ASSIGN(std::vector<std::string> others, images_in(folder_ / "images"));
        std::erase_if(others, [&used](const std::string& name) { return used.contains(name); });
        if (!others.empty())
            notice(format("%zu pictures of images/ are not used, such as '%s', which has no camera",
                          others.size(), shown(others[0]).c_str()));
        return {};
    }

    Status find_masks() {
        std::vector<std::string> missing;
        for (ListedPhoto& photo : listed_) {
            const bool named = options_.masks.empty();
            if (named && photo.mask.empty()) continue;
            fs::path below = os::path_of(options_.masks) / name_below_images(photo.camera.name);
            const fs::path path = named ? folder_ / photo.mask : below;
            SPLAT_SET(photo.mask, named ? file_at(path, {""}) : file_at(path, {".png", ""}));
            if (!named && photo.mask.empty())
                SPLAT_SET(photo.mask, file_at(below.replace_extension(), {".png"}));
            if (photo.mask.empty()) missing.push_back(os::text_of(path));
        }
        if (missing.empty()) return {};
        return not_found(
            "%zu of %zu masks are missing, such as '%s'; expected one for each photograph, named "
            "like it, of which 0 leaves pixels out",
            missing.size(), listed_.size(), missing[0].c_str());
    }

    [[nodiscard]] Status find_maps() const {
        std::vector<std::string> names;
        for (const ListedPhoto& photo : listed_)
            if (!photo.held_out) names.push_back(name_below_images(photo.camera.name));
        return find_photo_maps(options_, names);
    }

    /// Keeps the points that can be in the scene.
    Status keep_points() {
        scene::Vec3 middle{};
        for (const ListedPhoto& photo : listed_)
            middle += scene::camera_center(photo.camera) / static_cast<double>(listed_.size());
        double spread = 0;
        for (const ListedPhoto& photo : listed_)
            spread = std::max(spread, glm::length(scene::camera_center(photo.camera) - middle));
        std::size_t invalid_ones = 0, far_ones = 0;
        for (std::size_t i = 0; i < points_.positions.size(); ++i) {
            const scene::Vec3& point = points_.positions[i];
            const bool is_valid = scene::is_finite(point);
            const bool is_far =
                is_valid && spread > 0 && glm::length(point - middle) > kFarthest * spread;
            invalid_ones += is_valid ? 0 : 1;
            far_ones += is_far ? 1 : 0;
            if (!is_valid || is_far) continue;
            result_.points.push_back(point);
            result_.colors.push_back(points_.colors.empty()
                                         ? std::array<std::uint8_t, 3>{128, 128, 128}
                                         : points_.colors[i]);
        }
        const auto left_out = [&](std::size_t count, const char* why) {
            if (count > 0)
                notice(format("%zu of %zu points are left out: %s", count, points_.positions.size(),
                              why));
        };
        left_out(invalid_ones, "they are not finite");
        left_out(far_ones, "they are 10,000 times farther away than the cameras are from another");
        return {};
    }

    Status read_photographs() {
        std::vector<PosedPhoto> photos(listed_.size());
        std::atomic<std::size_t> done = 0;
        SPLAT_TRY(parallel_for(listed_.size(), kMostHostThreads, [&](std::size_t i) -> Status {
            SPLAT_SET(photos[i], read_photograph(listed_[i]));
            return options_.progress ? options_.progress(++done, listed_.size()) : Status();
        }));
        tell_of_lenses(photos);
        std::vector<std::string> empty;
        for (std::size_t i = 0; i < photos.size(); ++i) {
            if (std::ranges::any_of(photos[i].pixels, [](std::uint32_t p) { return p != 0; }))
                result_.photos.push_back(std::move(photos[i]));
            else
                empty.push_back(listed_[i].camera.name);
        }
        if (empty.empty()) return {};
        const std::string lack =
            format("%zu of %zu photographs have no pixel that counts, such as '%s'", empty.size(),
                   listed_.size(), shown(empty[0]).c_str());
        std::erase_if(listed_, [&empty](const ListedPhoto& photo) {
            return std::ranges::find(empty, photo.camera.name) != empty.end();
        });
        if (!check_count().ok())
            return damaged(
                "'%s': %s; masks leave out where they are 0, transparent pictures where "
                "they are not opaque",
                os::text_of(folder_).c_str(), lack.c_str());
        notice(lack + ", and are left out");
        return {};
    }

    /// Tells of photographs of one colour. Errors: kFormat if all have one, or are equal.
    Status check_colors() {
        const std::vector<PosedPhoto>& photos = result_.photos;
        const auto is_plain = [](const PosedPhoto& photo) {
            std::uint32_t color = 0;
            return std::ranges::all_of(photo.pixels, [&color](std::uint32_t pixel) {
                if (color == 0) color = pixel;
                return pixel == 0 || pixel == color;
            });
        };
        const std::ptrdiff_t plain = std::ranges::count_if(photos, is_plain);
        const bool are_equal = std::ranges::all_of(photos, [&photos](const PosedPhoto& photo) {
            return photo.pixels == photos[0].pixels;
        });
        if (are_equal || plain == std::ssize(photos))
            return damaged("'%s': all %zu photographs %s, so that no scene can be found by them",
                           os::text_of(folder_).c_str(), photos.size(),
                           are_equal ? "are equal" : "have one colour alone");
        if (plain > 0)
            notice(format("%td of %zu photographs have one colour alone, such as '%s'", plain,
                          photos.size(),
                          shown(std::ranges::find_if(photos, is_plain)->name).c_str()));
        return {};
    }

    /// The photograph as a pinhole sees it, at the size of the fit.
    [[nodiscard]] Result<PosedPhoto> read_photograph(const ListedPhoto& listed) const {
        SPLAT_ASSIGN(const io::Image image, load_bytes(os::path_of(listed.path), {}));
        PosedPhoto photo{listed.camera.name, listed.camera, listed.held_out,
                         image.width,        image.height,  {}};
        SPLAT_TRY(fit_camera(listed.path, photo));
        const std::uint32_t factor = is_reduced_ ? 1 : factor_;
        if (factor > std::min(photo.width, photo.height))
            return invalid("downscale is %u, expected at most %u, the shorter side of '%s'", factor,
                           std::min(photo.width, photo.height), listed.path.c_str());
        take_pixels(image, photo);
        if (!listed.mask.empty()) SPLAT_TRY(apply_mask(listed, photo));
        if (!listed.held_out)
            SPLAT_TRY(read_photo_maps(options_, name_below_images(photo.name), photo));
        return undistort(photo, listed.lens, factor);
    }

    /// Compares the sizes of photograph and camera, or adapts the camera to images_D/.
    Status fit_camera(const std::string& path, PosedPhoto& photo) const {
        scene::Camera& camera = photo.camera;
        const std::uint32_t factor = is_reduced_ ? factor_ : 1;
        const auto fits = [factor](std::uint32_t side, std::uint32_t whole) {
            const auto more = static_cast<std::int64_t>(std::uint64_t{side} * factor) - whole;
            return factor == 1 ? more == 0 : std::abs(more) <= factor;
        };
        if (!fits(photo.width, camera.width) || !fits(photo.height, camera.height))
            return damaged(
                "'%s': %u x %u pixels, its camera has %u x %u%s: cameras are those of the "
                "photographs as they are stored, neither turned nor scaled",
                path.c_str(), photo.width, photo.height, camera.width, camera.height,
                is_reduced_ ? format(", of which it should be 1/%u", factor).c_str() : "");
        const double x = static_cast<double>(photo.width) / camera.width;
        const double y = static_cast<double>(photo.height) / camera.height;
        camera.fx *= x;
        camera.cx *= x;
        camera.fy *= y;
        camera.cy *= y;
        camera.width = photo.width;
        camera.height = photo.height;
        return {};
    }

    void take_pixels(const io::Image& image, PosedPhoto& photo) const {
        const std::uint32_t channels = image.channels;
        const bool has_alpha = channels == 2 || channels == 4;
        const std::uint32_t green = channels > 2 ? 1 : 0, blue = 2 * green;
        photo.pixels.resize(std::size_t{image.width} * image.height);
        const std::uint16_t* from = image.samples.data();
        for (std::uint32_t& pixel : photo.pixels) {
            const std::uint32_t alpha = has_alpha ? from[channels - 1] : 255;
            const auto shown = [&](std::uint32_t value) {
                return (value * alpha + 255 * (255 - alpha) + 127) / 255;
            };
            if (alpha == 255 || options_.white_background)
                pixel =
                    shown(from[0]) | shown(from[green]) << 8 | shown(from[blue]) << 16 | 255U << 24;
            from += channels;
        }
    }

    static Status apply_mask(const ListedPhoto& listed, PosedPhoto& photo) {
        SPLAT_ASSIGN(const io::Image mask, load_bytes(os::path_of(listed.mask), {}));
        const bool own = mask.width == photo.width && mask.height == photo.height;
        if (!own && (mask.width != listed.camera.width || mask.height != listed.camera.height))
            return damaged("'%s': %u x %u pixels, its photograph '%s' has %u x %u",
                           listed.mask.c_str(), mask.width, mask.height, listed.path.c_str(),
                           photo.width, photo.height);
        const auto nearest = [](std::uint32_t i, std::uint32_t from, std::uint32_t to) {
            return (2 * std::size_t{i} + 1) * from / (2 * std::size_t{to});
        };
        for (std::uint32_t y = 0; y < photo.height; ++y)
            for (std::uint32_t x = 0; x < photo.width; ++x) {
                const std::size_t at = nearest(y, mask.height, photo.height) * mask.width +
                                       nearest(x, mask.width, photo.width);
                if (mask.samples[at * mask.channels] == 0)
                    photo.pixels[std::size_t{y} * photo.width + x] = 0;
            }
        return {};
    }

    void tell_of_lenses(const std::vector<PosedPhoto>& photos) {
        std::vector<scene::Lens> lenses;
        std::size_t count = 0, pixels = 0, valid = 0;
        std::string first;
        for (std::size_t i = 0; i < photos.size(); ++i) {
            if (scene::is_pinhole(listed_[i].lens)) continue;
            if (count++ == 0) first = photos[i].name;
            if (std::ranges::find(lenses, listed_[i].lens) == lenses.end())
                lenses.push_back(listed_[i].lens);
            pixels += photos[i].pixels.size();
            valid += photos[i].pixels.size() -
                     static_cast<std::size_t>(std::ranges::count(photos[i].pixels, 0U));
        }
        if (count == 0) return;
        notice(format(
            "%s of %zu photographs is undone (%s, '%s'); %.1f %% of their pixels count",
            lenses.size() == 1 ? "the lens" : format("each of %zu lenses", lenses.size()).c_str(),
            count, scene::lens_text(lenses[0]).c_str(), shown(first).c_str(),
            100.0 * static_cast<double>(valid) / static_cast<double>(pixels)));
    }

    fs::path folder_;
    const PosedPhotosOptions& options_;
    std::uint32_t factor_;
    bool is_reduced_ = false;  ///< photographs are those of images_D/
    std::vector<ListedPhoto> listed_;
    io::ColoredPoints points_;
    PosedPhotos result_;
};

}  // namespace

Result<PosedPhotos> load_posed_photos(const std::string& folder,
                                      const PosedPhotosOptions& options) {
    return PhotoLoader(folder, options).load();
}

}  // namespace splat::data
