// What a fit's Gaussians are to begin with.

#include <algorithm>
#include <cmath>

#include "core/log.h"
#include "fit/first_gaussians.h"
#include "fit/fit_task.h"
#include "io/compress.h"
#include "io/scene_file.h"
#include "scene/arrays.h"

namespace splat::fit {
namespace {

constexpr std::uint32_t kRandomPoints = 10000;
constexpr std::size_t kDensePoints = 15000;

}  // namespace

Result<Priors> FitTask::choose_first(std::vector<data::PosedPhoto>& fitted,
                                     run::Messages& messages) {
    Priors priors{options_.depth_weight, options_.normal_weight, {}};
    std::size_t aligned = 0;
    for (const data::PosedPhoto& photo : fitted) {
        priors.alignments.push_back(aligned_to_points(photo, points_.positions));
        if (priors.alignments.back()) ++aligned;
    }
    if (!options_.depth.empty())
        messages.push_back({format(
            "%zu of %zu depth maps are aligned with the points%s", aligned, fitted.size(),
            aligned < fitted.size() ? ", the others with what is drawn, in each step" : "")});
    const bool is_scene =
        options_.init != "points" && options_.init != "depth" && options_.init != "random";
    if (is_scene) SPLAT_TRY(use_scene());
    if (options_.init == "depth") SPLAT_TRY(use_depth(fitted, priors, messages));
    const bool lacks = points_.positions.size() < 2;
    if (!is_scene && (lacks || options_.init == "random")) {
        std::vector<scene::Camera> cameras;
        for (const data::PosedPhoto& photo : fitted) cameras.push_back(photo.camera);
        points_ = random_points(cameras, kRandomPoints, options_.seed);
        if (points_.positions.size() < 2)
            return damaged(
                "'%s' has no points to begin with, and hardly a place that two of its cameras see: "
                "look at their poses",
                options_.data.c_str());
        if (lacks)
            messages.push_back(
                {format("no points to begin with: %zu random ones, where the cameras look",
                        points_.positions.size())});
    }
    for (data::PosedPhoto& photo : fitted) {
        if (!(priors.depth_weight > 0)) photo.nearness = {};
        if (!(priors.normal_weight > 0)) photo.normals = {};
    }
    return priors;
}

Status FitTask::use_depth(std::span<const data::PosedPhoto> fitted, const Priors& priors,
                          run::Messages& messages) {
    if (std::none_of(priors.alignments.begin(), priors.alignments.end(),
                     [](const auto& alignment) { return alignment.has_value(); }))
        return damaged(
            "'%s': no depth map of '%s' can be aligned: each needs 16 points of the data in its "
            "view, of which it shows the nearer ones by larger numbers; begin with points or "
            "random ones instead, or set depth_is_distance=true for maps of distances",
            options_.data.c_str(), options_.depth.c_str());
    const io::ColoredPoints dense = dense_points(fitted, priors.alignments, kDensePoints);
    messages.push_back({format("%zu points of the depth maps, and %zu of the data, to begin with",
                               dense.positions.size(), points_.positions.size())});
    points_.positions.insert(points_.positions.end(), dense.positions.begin(),
                             dense.positions.end());
    points_.colors.insert(points_.colors.end(), dense.colors.begin(), dense.colors.end());
    return {};
}

Status FitTask::use_scene() {
    const std::string& path = options_.init;
    auto read = io::load_scene(path);
    if (read.status().code() == Code::kNotFound)
        return not_found("init is '%s', expected points, depth, random or a file of a scene",
                         path.c_str());
    SPLAT_ASSIGN(io::LoadedScene loaded, std::move(read));
    if (loaded.gaussians.drawn_as.linear_colors)
        return unsupported("'%s' has linear colours, expected those of the display (sRGB)",
                           path.c_str());
    for (const std::string& name : scene::drawn_as_names(loaded.gaussians.drawn_as))
        log(LogLevel::kWarning, format("'%s' is to be drawn with '%s', which a fit does not use",
                                       path.c_str(), name.c_str()));
    if (loaded.gaussians.count() == 0 || loaded.report.non_finite_values > 0)
        return damaged(
            "'%s': %zu Gaussians, %llu values of which are not finite, expected finite "
            "ones to begin with",
            path.c_str(), loaded.gaussians.count(), llu(loaded.report.non_finite_values));
    for (const std::vector<float>* const values :
         {&loaded.gaussians.means, &loaded.gaussians.sh, &loaded.gaussians.opacity_logits,
          &loaded.gaussians.log_scales, &loaded.gaussians.rotations})
        data_sum_ = io::crc32_of(std::as_bytes(std::span(*values)), data_sum_);
    first_ = std::move(loaded.gaussians);
    for (std::size_t i = 0; i < first_->means.size(); ++i)
        first_->means[i] =
            static_cast<float>(static_cast<double>(first_->means[i]) - frame_.center[i % 3]);
    return {};
}

std::size_t FitTask::first_count() const {
    return first_ ? first_->count() : points_.positions.size();
}

Status FitTask::check_first() const {
    const std::uint32_t most = fitter_->schedule().most_gaussians();
    if (!first_ || first_->count() <= most) return {};
    return invalid("'%s' has %zu Gaussians, but the fit takes at most %u: raise %s",
                   options_.init.c_str(), first_->count(), most,
                   most == options_.memory_gaussians ? "memory_gaussians" : "max_gaussians");
}

Status FitTask::place_first(std::size_t least) {
    SPLAT_TRY(check_first());
    scene::Gaussians made;
    if (!first_)
        SPLAT_SET(made,
                  first_gaussians(points_, fitter_->schedule().first_gaussians(), options_.seed));
    const scene::Gaussians& first = first_ ? *first_ : made;
    if (first.count() >= least) return on_device([&] { return fitter_->begin(first); });
    std::vector<std::size_t> rows(least);
    for (std::size_t i = 0; i < least; ++i) rows[i] = i % first.count();
    scene::Gaussians copies = scene::gather(first, rows);
    const double share = static_cast<double>(first.count()) / static_cast<double>(least);
    for (float& scale : copies.log_scales) scale += static_cast<float>(std::log(share) / 2);
    return on_device([&] { return fitter_->begin(copies); });
}

}  // namespace splat::fit
