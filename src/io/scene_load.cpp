#include "io/scene_load.h"

#include <cmath>

#include "core/log.h"
#include "scene/arrays.h"

namespace splat::io {
namespace {

std::uint64_t count_non_finite(const std::vector<float>& values) {
    std::uint64_t count = 0;
    for (const float value : values) count += std::isfinite(value) ? 0 : 1;
    return count;
}

}  // namespace

Status check_count(std::uint64_t count, std::uint32_t sh_degree, const LoadOptions& options,
                   DecodeBudget& budget, const char* format) {
    if (count > options.max_count)
        return unsupported("%s: %llu Gaussians, the limit is %llu; raise max_count", format,
                           llu(count), llu(options.max_count));
    const std::uint64_t floats = 11 + 3 * std::uint64_t{scene::sh_coefficients(sh_degree)};
    return budget.take(count, floats * sizeof(float), std::string(format) + ": Gaussians");
}

LoadedScene finish_load(scene::Gaussians gaussians, LoadReport report, scene::Frame usual,
                        const LoadOptions& options) {
    SPLAT_ASSERT(scene::check_arrays(gaussians).ok());
    report.count = gaussians.count();
    report.sh_degree = gaussians.sh_degree;
    report.frame = options.frame.value_or(usual);
    report.bad_rotations = scene::normalise_rotations(gaussians);
    for (const auto* values : {&gaussians.means, &gaussians.log_scales, &gaussians.rotations,
                               &gaussians.opacity_logits, &gaussians.sh})
        report.non_finite_values += count_non_finite(*values);
    scene::convert_frame(gaussians, report.frame, scene::Frame::kRdf);
    return {std::move(gaussians), std::move(report)};
}

Result<scene::Gaussians> prepare_save(const scene::Gaussians& gaussians, scene::Frame usual,
                                      const SaveOptions& options) {
    SPLAT_TRY(scene::check_arrays(gaussians));
    const std::uint32_t degree = options.sh_degree.value_or(gaussians.sh_degree);
    if (degree > scene::kMaxShDegree)
        return invalid("sh_degree %u to write, expected 0 to %u", degree, scene::kMaxShDegree);
    scene::Gaussians copy = scene::with_sh_degree(gaussians, degree);
    scene::convert_frame(copy, scene::Frame::kRdf, options.frame.value_or(usual));
    return copy;
}

bool holds_numbers(const scene::Gaussians& g, std::size_t i) {
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    return all_finite(g.means, i, 3) && all_finite(g.log_scales, i, 3) &&
           all_finite(g.rotations, i, 4) && all_finite(g.sh, i, each) &&
           !std::isnan(g.opacity_logits[i]);
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

}  // namespace splat::io
