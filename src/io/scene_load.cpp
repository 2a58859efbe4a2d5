#include "io/scene_load.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/large_vector.h"
#include "core/log.h"
#include "scene/arrays.h"

namespace splat::io {
namespace {

std::uint64_t count_non_finite(const std::vector<float>& values) {
    std::uint64_t count = 0;
    for (const float value : values) count += std::isfinite(value) ? 0 : 1;
    return count;
}

scene::Gaussians saved(scene::Gaussians gaussians, scene::Frame usual, const SaveOptions& options) {
    const std::uint32_t degree = options.sh_degree.value_or(gaussians.sh_degree);
    gaussians = scene::with_sh_degree(std::move(gaussians), degree);
    scene::convert_frame(gaussians, scene::Frame::kRdf, options.frame.value_or(usual));
    return gaussians;
}

}  // namespace

Status check_count(std::uint64_t count, std::uint32_t sh_degree, const LoadOptions& options,
                   DecodeBudget& budget, const char* format) {
    if (count > options.max_count)
        return unsupported("%s: %llu Gaussians, the limit is %llu; raise max_count", format,
                           llu(count), llu(options.max_count));
    if (options.head != nullptr) {
        *options.head = {count, sh_degree};
        return error(Code::kCancelled, "%s: only the head is read", format);
    }
    const std::uint64_t floats = 11 + 3 * std::uint64_t{scene::sh_coefficients(sh_degree)};
    return budget.take(count, floats * sizeof(float), std::string(format) + ": Gaussians");
}

LoadedScene finish_load(scene::Gaussians gaussians, LoadReport report, scene::Frame usual,
                        const LoadOptions& options) {
    SPLAT_ASSERT(scene::check_arrays(gaussians).ok());
    report.count = gaussians.count();
    report.sh_degree = gaussians.sh_degree;
    report.frame = options.frame.value_or(usual);
    report.drawn_as = gaussians.drawn_as;
    report.bad_rotations = scene::normalise_rotations(gaussians);
    for (const auto* values : {&gaussians.means, &gaussians.log_scales, &gaussians.rotations,
                               &gaussians.opacity_logits, &gaussians.sh})
        report.non_finite_values += count_non_finite(*values);
    scene::convert_frame(gaussians, report.frame, scene::Frame::kRdf);
    return {std::move(gaussians), std::move(report)};
}

void discard(Bytes read) {
    discard_pages(const_cast<std::byte*>(read.data()), read.size());
}

Status check_save(const scene::Gaussians& gaussians, const SaveOptions& options) {
    SPLAT_TRY(scene::check_arrays(gaussians));
    const std::uint32_t degree = options.sh_degree.value_or(gaussians.sh_degree);
    if (degree <= scene::kMaxShDegree) return {};
    return invalid("sh_degree %u to write, expected 0 to %u", degree, scene::kMaxShDegree);
}

Result<scene::Gaussians> prepare_save(const scene::Gaussians& gaussians, scene::Frame usual,
                                      const SaveOptions& options) {
    SPLAT_TRY(check_save(gaussians, options));
    return saved(gaussians, usual, options);
}

Status for_saved_blocks(
    const scene::Gaussians& gaussians, scene::Frame usual, const SaveOptions& options,
    const std::function<Status(scene::Gaussians& block, std::size_t first)>& work) {
    SPLAT_TRY(check_save(gaussians, options));
    for (std::size_t first = 0; first < gaussians.count(); first += kSceneBlock) {
        const std::size_t count = std::min(kSceneBlock, gaussians.count() - first);
        scene::Gaussians block = saved(scene::part(gaussians, first, count), usual, options);
        SPLAT_TRY(work(block, first));
    }
    return {};
}

bool loses_scale(float log_scale) {
    const double scale = std::exp(static_cast<double>(log_scale));
    return std::isfinite(log_scale) &&
           (scale > static_cast<double>(std::numeric_limits<float>::max()) ||
            static_cast<float>(scale) == 0);
}

bool holds_numbers(const scene::Gaussians& g, std::size_t i) {
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    return all_finite(g.means, i, 3) && all_finite(g.log_scales, i, 3) &&
           all_finite(g.rotations, i, 4) && all_finite(g.sh, i, each) &&
           !std::isnan(g.opacity_logits[i]);
}

Status check_numbers(const scene::Gaussians& g, const char* format, std::size_t first) {
    for (std::size_t i = 0; i < g.count(); ++i)
        if (!holds_numbers(g, i))
            return invalid(
                "%s: Gaussian %zu has a value that is not finite, which the format cannot hold; "
                "remove it, or write .ply",
                format, first + i);
    return {};
}

std::string dropped_bands(std::uint32_t file_degree) {
    const std::uint32_t first = scene::kMaxShDegree + 1;
    const std::string bands = file_degree > first ? splat::format("s %u to %u", first, file_degree)
                                                  : splat::format(" %u", first);
    return "SH band" + bands + splat::format(" (read to degree %u)", scene::kMaxShDegree);
}

std::size_t clipped_colors(const scene::Gaussians& g, double scale) {
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    std::size_t clipped = 0;
    for (std::size_t i = 0; i < g.sh.size(); ++i)
        if (i % each < 3 && std::abs(scale * static_cast<double>(g.sh[i])) > 0.5 + 0.5 / 255)
            ++clipped;
    return clipped;
}

void warn_of_loss(const char* format, std::size_t count, std::size_t all, const char* what) {
    if (count > 0)
        log(LogLevel::kWarning, splat::format("%s: %zu of %zu %s", format, count, all, what));
}

void warn_of_drawing(const char* format, const scene::DrawnAs& scene, const scene::DrawnAs& says,
                     const scene::DrawnAs& always) {
    const auto warn = [format](const scene::DrawnAs& have, const scene::DrawnAs& in,
                               const std::array<const char*, 2>& text) {
        const auto held = scene::drawn_as_names(in);
        for (const std::string& name : scene::drawn_as_names(have))
            if (std::ranges::find(held, name) == held.end())
                log(LogLevel::kWarning, std::string(format) + ": " + text[0] + name + text[1]);
    };
    warn(scene, says,
         {"the scene is to be drawn with '",
          "', which the format does not say: other programs will draw the file otherwise"});
    warn(always, scene,
         {"every file of the format is to be drawn with '",
          "', and the scene is not: pictures will differ a little"});
}

}  // namespace splat::io
