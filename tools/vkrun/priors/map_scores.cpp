#include "vkrun/priors/map_scores.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/os/path.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"

namespace vkrun {
namespace {

constexpr std::uint32_t kLeastFidelitySide = 41;  ///< limit of splat_prior_compare_images

/// The numbers of a file, 0 to 1 but for .npy and .pfm, which are as they are.
struct StoredMap {
    std::vector<float> values;  ///< [height,width,channels]
    splat_image image{};
    bool numbers = false;  ///< read from a .npy or .pfm

    /// `count` channels from `first` on.
    [[nodiscard]] splat_image channels(std::uint32_t first, std::uint32_t count) const {
        splat_image view = image;
        view.pixels = const_cast<float*>(values.data()) + first;  // only read
        view.bytes = 0;
        view.channels = count;
        view.channel_stride = sizeof(float);
        view.pixel_stride = view.channel_stride * image.channels;
        view.row_stride = view.pixel_stride * image.width;
        return view;
    }
    [[nodiscard]] bool has_alpha() const { return image.channels % 2 == 0; }
};

StoredMap load_map(const std::filesystem::path& path) {
    StoredMap map;
    const std::string extension = extension_of(path);
    map.numbers = extension == ".npy" || extension == ".pfm";
    map.image.type = SPLAT_PIXEL_F32;
    check(splat_image_load(splat::os::text_of(path).c_str(), &map.image, nullptr), kBadData);
    map.values.resize(std::size_t{map.image.width} * map.image.height * map.image.channels);
    map.image.pixels = map.values.data();
    check(splat_image_load(splat::os::text_of(path).c_str(), &map.image, nullptr), kBadData);
    return map;
}

/// In the units of the published scores, 0 to 255; a .npy has its own.
StoredMap load_depth(const std::filesystem::path& path) {
    StoredMap map = load_map(path);
    if (!map.numbers)
        for (float& value : map.values) value *= 255;
    return map;
}

/// Checks the result of comparing two maps. The library advises a mask, which this command does not take.
void check_maps(splat_result result) {
    try {
        check(result, kBadData);
    } catch (const Failure& failure) {
        throw with_advice(failure, "leave such pixels out with a mask",
                          "write finite numbers there");
    }
}

std::vector<double> depth_scores(const std::filesystem::path& prediction,
                                 const std::filesystem::path& truth, const ScoreOptions& options) {
    const StoredMap p = load_depth(prediction), g = load_depth(truth);
    const splat_image a = p.channels(0, 1), b = g.channels(0, 1);
    auto s = sized<splat_depth_scores>();
    check_maps(splat_prior_compare_depth(
        &a, &b, nullptr, options.published ? std::uint32_t{SPLAT_DEPTH_AS_PUBLISHED} : 0U, &s));
    return {s.abs_rel, s.rmse, s.si_rmse, s.within[0], s.within[1], s.within[2]};
}

/// Files of images hold (n + 1) / 2, .npy files the vectors.
StoredMap load_normals(const std::filesystem::path& path) {
    StoredMap map = load_map(path);
    if (map.image.channels < 3)
        throw Failure(kBadData, "'" + splat::os::text_of(path) + "' has " +
                                    std::to_string(map.image.channels) +
                                    " channels, expected the x, y and z of normals");
    if (map.numbers)
        for (float& value : map.values) value = (value + 1) / 2;
    return map;
}

/// The published scores count the background of the truth, opaque (188, 188, 188), as predicted.
void replace_background(StoredMap& p, const StoredMap& g) {
    constexpr float kBackground = 188.0F / 255, kHalfStep = 0.5F / 255;
    const std::size_t pixels = std::size_t{g.image.width} * g.image.height;
    const std::uint32_t channels = g.image.channels, to = p.image.channels;
    for (std::size_t i = 0; i < pixels; ++i) {
        const float* const truth = g.values.data() + i * channels;
        const bool opaque = channels < 4 || truth[3] > 1 - kHalfStep;
        const bool gray = std::all_of(truth, truth + 3, [](float value) {
            return std::abs(value - kBackground) < kHalfStep;
        });
        if (!opaque || !gray) continue;
        std::copy_n(truth, 3, p.values.data() + i * to);
        if (to >= 4) p.values[i * to + 3] = 1;
    }
}

double fidelity_of(StoredMap& p, const StoredMap& g, bool published) {
    if (g.image.width < kLeastFidelitySide || g.image.height < kLeastFidelitySide)
        return std::numeric_limits<double>::quiet_NaN();
    const bool same = p.image.width == g.image.width && p.image.height == g.image.height;
    if (published && same) replace_background(p, g);
    const bool alpha = published && p.image.channels == 4 && g.image.channels == 4;
    const splat_image a = p.channels(0, alpha ? 4 : 3), b = g.channels(0, alpha ? 4 : 3);
    auto s = sized<splat_fidelity_scores>();
    const std::uint32_t flags = published ? SPLAT_FIDELITY_RANGE_1 | SPLAT_FIDELITY_WITH_ALPHA : 0U;
    check(splat_prior_compare_images(&a, &b, flags, &s), kBadData);
    return s.vif;
}

std::vector<double> normal_scores(const std::filesystem::path& prediction,
                                  const std::filesystem::path& truth, const ScoreOptions& options) {
    StoredMap p = load_normals(prediction);
    const StoredMap g = load_normals(truth);
    const splat_image a = p.channels(0, 3), b = g.channels(0, 3);
    auto s = sized<splat_normal_scores>();
    check_maps(splat_prior_compare_normals(&a, &b, nullptr, 0, &s));
    return {s.mean,
            s.median,
            s.rmse,
            s.within[0],
            s.within[1],
            s.within[2],
            fidelity_of(p, g, options.published)};
}

/// Masks of 0 and 1 as 0 and 255 are.
StoredMap load_mask(const std::filesystem::path& path) {
    constexpr float kOne = 1.5F / 255;
    StoredMap map = load_map(path);
    const bool binary =
        std::all_of(map.values.begin(), map.values.end(), [](float value) { return value < kOne; });
    if (binary && !map.numbers)
        for (float& value : map.values) value = value > 0 ? 1 : 0;
    return map;
}

/// The alpha of a picture of the object; of a mask, its alpha unless that is opaque everywhere, else its first channel.
splat_image mask_channel(const StoredMap& map, const std::filesystem::path& path) {
    const std::uint32_t channels = map.image.channels;
    bool counts = map.has_alpha();
    if (path.parent_path().filename() == "rgb") {
        if (!counts)
            throw Failure(kBadData, "'" + splat::os::text_of(path) +
                                        "' has no alpha, which would be its mask");
    } else if (counts) {
        float least = 1;
        for (std::size_t i = channels - 1; i < map.values.size(); i += channels)
            least = std::min(least, map.values[i]);
        counts = least < 1;
    }
    return map.channels(counts ? channels - 1 : 0, 1);
}

std::vector<double> mask_scores(const std::filesystem::path& prediction,
                                const std::filesystem::path& truth, const ScoreOptions& options) {
    const StoredMap p = load_mask(prediction), g = load_mask(truth);
    const splat_image a = mask_channel(p, prediction), b = mask_channel(g, truth);
    auto s = sized<splat_mask_scores>();
    check(splat_prior_compare_masks(&a, &b,
                                    options.half ? std::uint32_t{SPLAT_MASK_ALPHA_HALF} : 0U, &s),
          kBadData);
    return {s.iou, s.f_beta, s.mae, s.precision, s.recall};
}

/// Planes are found within 5 cm, of maps in metres, and 10 degrees.
std::vector<double> plane_scores(const std::filesystem::path& prediction,
                                 const std::filesystem::path& truth) {
    constexpr double kDistance = 0.05, kDegrees = 10;
    const StoredMap p = load_map(prediction), g = load_map(truth);
    for (const auto& [map, path] : {std::pair(&p, &prediction), {&g, &truth}})
        if (!map->numbers || map->image.channels != 4)
            throw Failure(kBadData, "'" + splat::os::text_of(*path) +
                                        "' has no distances of planes, expected a .npy with 4 "
                                        "channels: 'vkrun priors plane --format npy' makes them");
    const splat_image a = p.channels(0, 4), b = g.channels(0, 4);
    auto s = sized<splat_plane_scores>();
    check(splat_prior_compare_planes(&a, &b, SPLAT_NORMAL_VECTORS, kDistance, kDegrees, &s),
          kBadData);
    return {s.covering, s.recall, s.precision};
}

}  // namespace

const std::vector<MapMetric>& metrics_of(const std::string& kind) {
    static const std::vector<MapMetric> depth = {{"abs_rel", false, 4}, {"rmse", false, 4},
                                                 {"si_rmse", false, 4}, {"delta1", true, 4},
                                                 {"delta2", true, 4},   {"delta3", true, 4}};
    static const std::vector<MapMetric> normal = {{"mean_degrees", false, 3},
                                                  {"median_degrees", false, 3},
                                                  {"rmse_degrees", false, 3},
                                                  {"within_11.25", true, 4},
                                                  {"within_22.5", true, 4},
                                                  {"within_30", true, 4},
                                                  {"vif", true, 4}};
    static const std::vector<MapMetric> mask = {{"iou", true, 4},
                                                {"f_beta", true, 4},
                                                {"mae", false, 5},
                                                {"precision", true, 4},
                                                {"recall", true, 4}};
    static const std::vector<MapMetric> plane = {
        {"covering", true, 4}, {"recall", true, 4}, {"precision", true, 4}};
    return kind == "depth" ? depth : kind == "normal" ? normal : kind == "plane" ? plane : mask;
}

std::vector<double> score_map(const std::filesystem::path& prediction,
                              const std::filesystem::path& truth, const ScoreOptions& options) {
    if (options.kind == "depth") return depth_scores(prediction, truth, options);
    if (options.kind == "normal") return normal_scores(prediction, truth, options);
    if (options.kind == "plane") return plane_scores(prediction, truth);
    return mask_scores(prediction, truth, options);
}

std::string explain_scores(const ScoreOptions& options) {
    if (options.kind == "depth")
        return std::string(
                   "Each depth map is aligned with the true one by scale and shift (least "
                   "squares). Errors are in units of 0 to 255 for images, else of the .npy "
                   "files; delta1 to delta3 are shares of pixels within a factor of 1.25, "
                   "1.25^2 and 1.25^3. ") +
               (options.published ? "Every pixel counts, as published."
                                  : "Pixels with a true depth above 0 count.");
    if (options.kind == "normal")
        return std::string("Angles in degrees at pixels with a true normal. ") +
               (options.published ? "VIF with values of 0 to 1, averaging in alpha where there is "
                                    "one, and with the true background (188, 188, 188) in "
                                    "predictions, as published."
                                  : "VIF with values of 0 to 255.");
    if (options.kind == "plane")
        return "The covering is the mean over the pixels of true planes of the best intersection "
               "over "
               "union of their plane. A true plane is found (recall) by a predicted one with more "
               "than "
               "0.5 of that, a normal within 10 degrees and a distance from the camera within "
               "0.05, "
               "which is 5 cm of maps in metres; the precision is the share of predicted planes "
               "that "
               "find one.";
    return std::string(
               "A prediction counts where it is above 0.5, the truth where alpha, or a gray "
               "mask, is above ") +
           (options.half ? "0.5." : "0.");
}

}  // namespace vkrun
