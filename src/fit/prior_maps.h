#pragma once

#include <span>

#include "data/posed_photos.h"
#include "fit/prior_loss.h"
#include "io/colored_points.h"

namespace splat::fit {

/// What a fit has besides photographs: the losses' weights, which decrease to a hundredth over the fit, and how maps of
/// depth are aligned, one for each photograph.
struct Priors {
    double depth_weight = 0, normal_weight = 0;
    std::vector<std::optional<PriorAlignment>> alignments = {};
};

/// Flags of a pixel's second number.
inline constexpr std::uint32_t kMapDepth = 1U << 24;
inline constexpr std::uint32_t kMapNormal = 2U << 24;

/// The maps of a photograph as the device holds them: for each pixel its relative inverse depth as a float's bits, and
/// R | G << 8 | B << 16 of its normal with flags of what is known. Both are where the photograph counts; a normal also
/// needs all four neighbours. Empty for a photograph without maps.
std::vector<std::uint32_t> packed_maps(const data::PosedPhoto& photo, PriorCounts& counts);

/// How a photograph's map of depth is aligned with the points that it may show: the line from map to inverse depth
/// whose 30th percentile of errors is least, of lines through pairs drawn at random, then improved by the points near
/// it (Tukey's weights). Points that something hides are outliers. Nothing without a map, with fewer than 16 points,
/// and where larger numbers of the map are farther.
///
/// Determinism  the same bits everywhere
/// Source       Rousseeuw 1984, doi:10.1080/01621459.1984.10477105 (least quantile of squares)
std::optional<PriorAlignment> aligned_to_points(const data::PosedPhoto& photo,
                                                std::span<const scene::Vec3> points);

/// About `count` points on the aligned maps of photographs, on a grid of pixels of each, with their colours. A point is
/// left out where more photographs see through it, by a tenth of its distance, than see it there. Photographs without
/// an alignment give none.
io::ColoredPoints dense_points(std::span<const data::PosedPhoto> photos,
                               std::span<const std::optional<PriorAlignment>> alignments,
                               std::size_t count);

}  // namespace splat::fit
