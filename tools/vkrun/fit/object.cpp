#include "vkrun/fit/object.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <vector>

#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/picture.h"
#include "vkrun/predict/network_mask.h"
#include "vkrun/priors/map_maker.h"
#include "vkrun/scene/camera_file.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

constexpr double kLeastCell = 0.125;  ///< side of a cell of clusters, in radii of the scene
constexpr double kSparseCell = 1.5;   ///< the same, times the cube root of the number of Gaussians
constexpr const char* kUsualPreset = "u2net";

using Cell = std::array<std::int64_t, 3>;

/// Sets the pixels of a mask to 0 or 255.
void make_binary(const fs::path& path) {
    LoadedPicture mask = load_picture(os::text_of(path));
    bool changes = false;
    for (std::uint8_t& value : mask.bytes) {
        const std::uint8_t wanted = value > 127 ? 255 : 0;
        changes = changes || value != wanted;
        value = wanted;
    }
    if (changes) check(splat_image_save(os::text_of(path).c_str(), &mask.image));
}

/// A view of the fit, with its mask.
struct MaskedView {
    splat_camera camera{};
    LoadedPicture mask;

    /// 0: not in the picture, -1: outside the mask, 1: inside.
    [[nodiscard]] int side_of(const std::array<double, 3>& mean) const {
        double point[3];
        for (int row = 0; row < 3; ++row) {
            const double* m = camera.world_to_camera + 4 * row;
            point[row] = m[0] * mean[0] + m[1] * mean[1] + m[2] * mean[2] + m[3];
        }
        if (!(point[2] > 0)) return 0;
        const double x = (camera.fx * point[0] / point[2] + camera.cx) / camera.width;
        const double y = (camera.fy * point[1] / point[2] + camera.cy) / camera.height;
        if (!(x >= 0 && x < 1 && y >= 0 && y < 1)) return 0;
        const splat_image& image = mask.image;
        const std::size_t at = static_cast<std::size_t>(y * image.height) * image.width +
                               static_cast<std::size_t>(x * image.width);
        return mask.bytes[at * image.channels] != 0 ? 1 : -1;
    }
};

/// The mask of a photograph, named as the library takes them; empty if there is none. Names of the file of cameras that
/// lead out of the folder have none.
std::string mask_of(const fs::path& folder, fs::path name) {
    name = name.lexically_normal();
    if (name.has_root_path() || name.empty() || *name.begin() == "..") return "";
    if (*name.begin() == "images") name = name.lexically_relative("images");
    const fs::path path = folder / name;
    fs::path same_stem = path;
    same_stem.replace_extension(".png");
    std::error_code none;
    for (const fs::path& file : {os::path_of(os::text_of(path) + ".png"), path, same_stem})
        if (fs::is_regular_file(file, none)) return os::text_of(file);
    return "";
}

/// The views of a run that have masks. Lenses are left out of account: half a mask is decided by many views.
std::vector<MaskedView> views_of(const Json& config) {
    const std::string path = cameras_in(config.at("data").get<std::string>(),
                                        config.value("cameras", "auto") == "transforms");
    CameraFileOptions reading{.size = {}, .ignore_distortion = true, .without_size = true};
    CameraFile file = load_cameras(path, reading);
    std::vector<MaskedView> views;
    for (std::size_t i = 0; i < file.cameras.size(); ++i) {
        const std::string mask =
            mask_of(os::path_of(config.at("masks").get<std::string>()), os::path_of(file.names[i]));
        if (mask.empty()) continue;
        LoadedPicture picture = load_picture(mask);
        if (reading.size.width == 0 &&
            !file.has_size(i)) {  // the photographs have that of their masks
            reading.size = {picture.image.width, picture.image.height};
            file = load_cameras(path, reading);
        }
        views.push_back({file.cameras[i], std::move(picture)});
    }
    return views;
}

std::vector<float> means_of(splat_scene scene, splat_scene_info& info) {
    info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene, &info));
    std::vector<float> means(3 * info.count);
    check(splat_scene_read(scene, "means", means.data(), means.size() * sizeof(float)));
    return means;
}

/// Keeps the Gaussians that are marked, with the values that they have. Returns how many.
std::size_t keep(splat_scene scene, const std::vector<bool>& marks) {
    std::vector<float> logits(marks.size());
    const std::size_t bytes = logits.size() * sizeof(float);
    check(splat_scene_read(scene, "opacity_logits", logits.data(), bytes));
    for (std::size_t i = 0; i < marks.size(); ++i)
        if (!marks[i]) logits[i] = -std::numeric_limits<float>::infinity();
    check(splat_scene_write(scene, "opacity_logits", logits.data(), bytes));
    check(splat_scene_filter(scene, 0, std::numeric_limits<double>::min()));
    return static_cast<std::size_t>(std::count(marks.begin(), marks.end(), true));
}

/// Whether at least half of the views that see a Gaussian have its mean inside their mask, for each.
std::vector<bool> inside_masks(const std::vector<MaskedView>& views,
                               const std::vector<float>& means) {
    std::vector<bool> marks(means.size() / 3);
    for (std::size_t i = 0; i < marks.size(); ++i) {
        int seen = 0, inside = 0;
        for (const MaskedView& view : views) {
            const int side = view.side_of({means[3 * i], means[3 * i + 1], means[3 * i + 2]});
            seen += side != 0 ? 1 : 0;
            inside += side > 0 ? 1 : 0;
        }
        marks[i] = seen > 0 && 2 * inside >= seen;
    }
    return marks;
}

/// The root of a cell among joined cells.
std::size_t root_of(std::vector<std::size_t>& parents, std::size_t i) {
    while (parents[i] != i) i = parents[i] = parents[parents[i]];
    return i;
}

/// Whether a Gaussian is in the cluster that has most of them, for each. A cluster is cells that touch each other.
std::vector<bool> in_largest_cluster(double radius, const std::vector<float>& means) {
    const double count = static_cast<double>(means.size()) / 3;
    const double side =
        std::max(radius, 1e-30) * std::max(kLeastCell, kSparseCell / std::cbrt(count));
    std::map<Cell, std::size_t> cells;
    std::vector<std::size_t> cell_of(means.size() / 3), counts, parents;
    for (std::size_t i = 0; i < cell_of.size(); ++i) {
        Cell cell{};
        for (std::size_t k = 0; k < 3; ++k)
            cell[k] = std::llround(std::clamp(double{means[3 * i + k]} / side, -1e15, 1e15));
        cell_of[i] = cells.emplace(cell, cells.size()).first->second;
        counts.resize(cells.size());
        ++counts[cell_of[i]];
    }
    for (std::size_t i = 0; i < counts.size(); ++i) parents.push_back(i);
    for (const auto& [cell, index] : cells)
        for (int near = 0; near < 27; ++near) {
            const auto found = cells.find(
                {cell[0] + near % 3 - 1, cell[1] + near / 3 % 3 - 1, cell[2] + near / 9 - 1});
            if (found != cells.end())
                parents[root_of(parents, index)] = root_of(parents, found->second);
        }
    std::vector<std::size_t> sums(counts.size());
    for (std::size_t i = 0; i < counts.size(); ++i) sums[root_of(parents, i)] += counts[i];
    const auto largest =
        static_cast<std::size_t>(std::max_element(sums.begin(), sums.end()) - sums.begin());
    std::vector<bool> marks;
    for (const std::size_t cell : cell_of) marks.push_back(root_of(parents, cell) == largest);
    return marks;
}

}  // namespace

std::string make_object_masks(const std::string& photos, const std::string& out, bool overwrite) {
    MapOptions options;
    options.map = "mask";
    options.in = photos;
    options.out = os::text_of(os::path_of(out) / "masks");
    options.overwrite = overwrite;
    const char* const model = std::getenv("SPLAT_MASK_MODEL");
    if (model != nullptr) options.model = model;
    if (options.model.empty()) options.preset = mask_preset_at_hand();
    if (options.model.empty() && options.preset.empty()) options.preset = kUsualPreset;
    std::fprintf(stderr, "--object: masks of the photographs, in '%s'\n", options.out.c_str());
    const MapReport report = make_maps(options);
    if (report.failed > 0)
        throw Failure(kBadData, std::to_string(report.failed) +
                                    " photographs have no mask: repair or remove them, or give "
                                    "masks with --masks");
    const std::string folder = os::text_of(os::path_of(options.out) / "mask");
    for (const fs::directory_entry& entry : fs::directory_iterator(os::path_of(folder)))
        if (extension_of(entry.path()) == ".png") make_binary(entry.path());
    return folder;
}

void keep_object(splat_scene scene, const std::string& out) {
    const Json config = Json::parse(read_text(os::text_of(os::path_of(out) / "config.json")));
    const std::vector<MaskedView> views = views_of(config);
    splat_scene_info info;
    std::vector<float> means = means_of(scene, info);
    const unsigned long long all = info.count;
    const std::vector<bool> marks = inside_masks(views, means);
    if (std::find(marks.begin(), marks.end(), true) == marks.end()) {
        std::fprintf(stderr,
                     "vkrun: warning: --object: no Gaussian lies inside the masks of '%s', so all "
                     "%llu stay; look at the masks\n",
                     config.at("masks").get<std::string>().c_str(), all);
        return;
    }
    const std::size_t inside = keep(scene, marks);
    means = means_of(scene, info);
    const std::size_t object = keep(scene, in_largest_cluster(info.radius, means));
    std::fprintf(stderr,
                 "--object: %zu of %llu Gaussians are the object; %llu lay outside the masks, %zu "
                 "apart from the largest cluster\n",
                 object, all, all - inside, inside - object);
}

}  // namespace vkrun
