#include <algorithm>
#include <limits>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "prior_scores/check_map.h"
#include "prior_scores/depth_scores.h"
#include "prior_scores/edges.h"
#include "prior_scores/information_fidelity.h"
#include "prior_scores/mask_scores.h"
#include "prior_scores/morphology.h"
#include "prior_scores/normal_scores.h"
#include "prior_scores/plane_scores.h"

using namespace splat;

namespace {

/// Two pictures of one size.
struct ImagePair {
    api::ImageView first, second;
};

/// `channels` of each; 0: those of the first. Messages use the names.
Result<ImagePair> pair_of(const splat_image* first, const char* first_name,
                          const splat_image* second, const char* second_name,
                          std::uint32_t channels) {
    ImagePair pair;
    SPLAT_ASSIGN(pair.first, api::image_to_read(first, first_name));
    SPLAT_ASSIGN(pair.second, api::image_to_read(second, second_name));
    if (channels == 0) channels = pair.first.channels;
    SPLAT_TRY(api::check_image_size(pair.first, first_name, pair.first.width, pair.first.height,
                                    channels));
    SPLAT_TRY(api::check_image_size(pair.second, second_name, pair.first.width, pair.first.height,
                                    channels));
    return pair;
}

/// Empty without a mask.
Result<std::vector<float>> mask_of(const splat_image* mask, const api::ImageView& map) {
    if (mask == nullptr) return std::vector<float>{};
    SPLAT_ASSIGN(const api::ImageView view, api::image_to_read(mask, "mask"));
    SPLAT_TRY(api::check_image_size(view, "mask", map.width, map.height, 1));
    return api::planes_of(view);
}

/// [3, height, width] of vectors.
std::vector<float> normals_of(const api::ImageView& view, std::uint32_t flags) {
    std::vector<float> normals = api::planes_of(view);
    if ((flags & SPLAT_NORMAL_VECTORS) == 0)
        for (float& x : normals) x = 2 * x - 1;
    return normals;
}

Result<prior_scores::Gradient> gradient_of(splat_map_filter filter) {
    switch (filter) {
        case SPLAT_MAP_FILTER_SOBEL:
            return prior_scores::Gradient::kSobel;
        case SPLAT_MAP_FILTER_SCHARR:
            return prior_scores::Gradient::kScharr;
        case SPLAT_MAP_FILTER_PREWITT:
            return prior_scores::Gradient::kPrewitt;
        default:
            return invalid("filter is %d, expected a SPLAT_MAP_FILTER_ value", filter);
    }
}

template <class T>
std::vector<float> floats_of(const std::vector<T>& values) {
    std::vector<float> floats;
    floats.reserve(values.size());
    for (const T value : values) floats.push_back(static_cast<float>(value));
    return floats;
}

Result<std::vector<float>> morphology_of(const std::vector<float>& map, const api::ImageView& view,
                                         splat_map_filter filter) {
    SPLAT_TRY(prior_scores::check_map(map, view.samples(), "map"));
    std::vector<std::uint8_t> mask;
    mask.reserve(map.size());
    for (const float value : map) mask.push_back(value > 0.5F ? 1 : 0);
    return floats_of(filter == SPLAT_MAP_FILTER_CLOSING
                         ? prior_scores::closing(mask, view.height, view.width)
                         : prior_scores::opening(mask, view.height, view.width));
}

Result<std::vector<float>> filtered_map(const api::ImageView& view, splat_map_filter filter) {
    const std::vector<float> map = api::planes_of(view);
    if (filter == SPLAT_MAP_FILTER_CANNY) {
        SPLAT_ASSIGN(const auto edges, prior_scores::canny_edges(map, view.height, view.width));
        return floats_of(edges);
    }
    if (filter == SPLAT_MAP_FILTER_CLOSING || filter == SPLAT_MAP_FILTER_OPENING)
        return morphology_of(map, view, filter);
    SPLAT_ASSIGN(const prior_scores::Gradient kind, gradient_of(filter));
    SPLAT_ASSIGN(const auto lengths,
                 prior_scores::gradient_length(map, view.height, view.width, kind));
    return floats_of(lengths);
}

/// Compare two maps: `make(pair)` returns the scores. `channels`: of each map; 0: as many as the first has.
template <class Scores, class Make>
splat_result compare(const splat_image* prediction, const splat_image* truth,
                     const char* truth_name, std::uint32_t channels, std::uint32_t flags,
                     std::uint32_t known_flags, Scores* scores, Make&& make) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const ImagePair pair,
                     pair_of(prediction, "prediction", truth, truth_name, channels));
        SPLAT_TRY(api::check_flags(flags, known_flags));
        SPLAT_TRY(api::check_fill(scores, "scores"));
        SPLAT_ASSIGN(const Scores filled, make(pair));
        api::give(filled, scores);
        return {};
    });
}

}  // namespace

splat_result splat_prior_compare_depth(const splat_image* prediction, const splat_image* truth,
                                       const splat_image* mask, uint32_t flags,
                                       splat_depth_scores* scores) {
    return compare(prediction, truth, "truth", 1, flags, SPLAT_DEPTH_AS_PUBLISHED, scores,
                   [&](const ImagePair& pair) -> Result<splat_depth_scores> {
                       SPLAT_ASSIGN(const std::vector<float> counted, mask_of(mask, pair.first));
                       SPLAT_ASSIGN(
                           const prior_scores::DepthScores made,
                           prior_scores::compare_depth(
                               api::planes_of(pair.first), api::planes_of(pair.second), counted,
                               flags != 0 ? prior_scores::DepthRule::kPublished
                                          : prior_scores::DepthRule::kValid));
                       splat_depth_scores filled{};
                       SPLAT_COPY(filled, made, pixels, abs_rel, rmse, si_rmse);
                       std::ranges::copy(made.within, filled.within);
                       filled.scale = made.scale;
                       filled.shift = made.shift;
                       return filled;
                   });
}

splat_result splat_prior_compare_normals(const splat_image* prediction, const splat_image* truth,
                                         const splat_image* mask, uint32_t flags,
                                         splat_normal_scores* scores) {
    return compare(prediction, truth, "truth", 3, flags, SPLAT_NORMAL_VECTORS, scores,
                   [&](const ImagePair& pair) -> Result<splat_normal_scores> {
                       SPLAT_ASSIGN(const std::vector<float> counted, mask_of(mask, pair.first));
                       SPLAT_ASSIGN(
                           const prior_scores::NormalScores made,
                           prior_scores::compare_normals(normals_of(pair.first, flags),
                                                         normals_of(pair.second, flags), counted));
                       splat_normal_scores filled{};
                       SPLAT_COPY(filled, made, pixels, missing, mean, median, rmse);
                       std::ranges::copy(made.within, filled.within);
                       return filled;
                   });
}

splat_result splat_prior_compare_planes(const splat_image* prediction, const splat_image* truth,
                                        uint32_t flags, double max_distance, double max_degrees,
                                        splat_plane_scores* scores) {
    return compare(prediction, truth, "truth", 4, flags, SPLAT_NORMAL_VECTORS, scores,
                   [&](const ImagePair& pair) -> Result<splat_plane_scores> {
                       const auto planes = [&](const api::ImageView& view) {
                           std::vector<float> numbers = api::interleaved_of(view);
                           for (std::size_t i = 0; flags == 0 && i < numbers.size(); ++i)
                               if (i % 4 != 3) numbers[i] = 2 * numbers[i] - 1;
                           return numbers;
                       };
                       SPLAT_ASSIGN(
                           const prior_scores::PlaneScores made,
                           prior_scores::compare_planes(planes(pair.first), planes(pair.second),
                                                        max_distance, max_degrees));
                       splat_plane_scores filled{};
                       filled.predicted_planes = made.predicted;
                       filled.true_planes = made.truth;
                       SPLAT_COPY(filled, made, pixels, covering, recall, precision);
                       return filled;
                   });
}

splat_result splat_prior_compare_masks(const splat_image* prediction, const splat_image* alpha,
                                       uint32_t flags, splat_mask_scores* scores) {
    return compare(prediction, alpha, "alpha", 1, flags, SPLAT_MASK_ALPHA_HALF, scores,
                   [&](const ImagePair& pair) -> Result<splat_mask_scores> {
                       SPLAT_ASSIGN(const prior_scores::MaskScores made,
                                    prior_scores::compare_masks(api::planes_of(pair.first),
                                                                api::planes_of(pair.second),
                                                                flags != 0 ? 0.5 : 0));
                       splat_mask_scores filled{};
                       SPLAT_COPY(filled, made, predicted_pixels, true_pixels, mae, iou, precision,
                                  recall, f_beta);
                       return filled;
                   });
}

splat_result splat_prior_compare_images(const splat_image* prediction, const splat_image* truth,
                                        uint32_t flags, splat_fidelity_scores* scores) {
    return compare(
        prediction, truth, "truth", 0, flags, SPLAT_FIDELITY_RANGE_1 | SPLAT_FIDELITY_WITH_ALPHA,
        scores, [&](const ImagePair& pair) -> Result<splat_fidelity_scores> {
            const prior_scores::FidelityOptions options = {
                (flags & SPLAT_FIDELITY_RANGE_1) != 0 ? 1.0 : 255.0,
                (flags & SPLAT_FIDELITY_WITH_ALPHA) != 0};
            SPLAT_ASSIGN(const prior_scores::FidelityScores made,
                         prior_scores::information_fidelity(
                             api::planes_of(pair.first), api::planes_of(pair.second),
                             pair.first.channels, pair.first.height, pair.first.width, options));
            splat_fidelity_scores filled{};
            filled.constant_channels = made.constant;
            filled.vif = made.vif;
            std::fill_n(filled.channels, 4, std::numeric_limits<double>::quiet_NaN());
            std::ranges::copy(made.channels, filled.channels);
            return filled;
        });
}

splat_result splat_prior_filter(const splat_image* map, splat_map_filter filter,
                                splat_image* filtered) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const ImagePair pair, pair_of(map, "map", filtered, "filtered", 1));
        SPLAT_ASSIGN(const api::ImageView out, api::image_to_fill(filtered, "filtered"));
        SPLAT_ASSIGN(const std::vector<float> made, filtered_map(pair.first, filter));
        api::fill_planes(out, made.data());
        return {};
    });
}
