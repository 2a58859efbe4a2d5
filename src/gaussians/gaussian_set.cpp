#include "gaussians/gaussian_set.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <span>

#include "core/finite.h"
#include "scene/activate.h"

namespace splat::gaussians {
namespace {

constexpr std::size_t kPiece = 65536;  ///< Gaussians packed at a time

void pack_gaussian(const scene::Gaussians& scene, std::size_t i, float* to) {
    const auto wide = [](float value) { return static_cast<double>(value); };
    std::copy_n(&scene.means[3 * i], 3, to);
    to[3] = static_cast<float>(scene::opacity_of(wide(scene.opacity_logits[i])));
    for (std::size_t k = 0; k < 3; ++k)
        to[4 + k] = static_cast<float>(std::exp(wide(scene.log_scales[3 * i + k])));
    std::copy_n(&scene.rotations[4 * i], 4, to + 8);
}

bool all_finite(std::span<const float> values) {
    return find_not_finite(values) == values.size();
}

/// False if a number of a packed Gaussian is not finite, or no rotation or opacity.
bool valid(std::span<const float> gaussian, std::span<const float> colors) {
    const auto rotation = gaussian.subspan(8);
    return all_finite(gaussian) && all_finite(colors) && gaussian[3] >= 0 && gaussian[3] <= 1 &&
           std::any_of(rotation.begin(), rotation.end(), [](float value) { return value != 0; });
}

void append(scene::Gaussians& to, std::span<const float> gaussian, std::span<const float> colors,
            float logit) {
    to.means.insert(to.means.end(), gaussian.begin(), gaussian.begin() + 3);
    // Rounded from float64, as that of float32 differs from one C library to another, by 1 ulp in 0.3% of all numbers.
    for (const double scale : gaussian.subspan(4, 3))
        to.log_scales.push_back(static_cast<float>(
            std::log(std::max(scale, double{std::numeric_limits<float>::min()}))));
    to.rotations.insert(to.rotations.end(), gaussian.begin() + 8, gaussian.end());
    to.opacity_logits.push_back(logit);
    to.sh.insert(to.sh.end(), colors.begin(), colors.end());
}

}  // namespace

vk::BufferView slice(const vk::BufferView& view, std::uint64_t first, std::uint64_t count,
                     std::uint64_t stride) {
    vk::BufferView part = view.part(first * stride * 16, count * stride * 16);
    part.shape = {static_cast<std::uint32_t>(count), static_cast<std::uint32_t>(stride * 4)};
    SPLAT_ASSERT(part.end() <= view.end());
    return part;
}

SetViews part(const SetDesc& desc, const SetViews& views, std::uint32_t first,
              std::uint32_t count) {
    SetViews found = views;
    found.gaussians = slice(views.gaussians, first, count, kGaussianFloats / 4);
    found.colors = slice(views.colors, first, count, desc.color_quads());
    found.count = count;
    return found;
}

std::uint64_t next_version() {
    static std::atomic<std::uint64_t> latest{0};
    return ++latest;
}

Result<GaussianSet> allocate_set(vk::Context& context, const SetDesc& desc) {
    const std::uint64_t count = std::max<std::uint64_t>(desc.gaussians, 1);
    GaussianSet set;
    set.desc = desc;
    set.count = desc.gaussians;
    SPLAT_ASSIGN(set.gaussians, context.memory().allocate(count * kGaussianFloats * 4,
                                                          vk::MemoryKind::kDevice, "Gaussians"));
    SPLAT_ASSIGN(set.colors, context.memory().allocate(count * desc.color_quads() * 16,
                                                       vk::MemoryKind::kDevice, "colours"));
    SPLAT_TRY(context.fill(set.gaussians.range(), 0));
    SPLAT_TRY(context.fill(set.colors.range(), 0));
    return set;
}

Status upload(vk::Context& context, const scene::Gaussians& scene, GaussianSet& to) {
    SPLAT_ASSERT(scene.count() <= to.desc.gaussians && !to.desc.direct_colors);
    to.count = static_cast<std::uint32_t>(scene.count());
    to.version = next_version();
    to.sh_degree = scene.sh_degree;
    const std::size_t quads = to.desc.color_quads();
    const std::size_t there = std::size_t{3} * scene::sh_coefficients(scene.sh_degree);
    const std::size_t taken = std::min<std::size_t>(there, to.desc.color_floats());
    const std::size_t piece = std::min(kPiece, scene.count());
    std::vector<float> gaussians(piece * kGaussianFloats);
    std::vector<float> colors(piece * quads * 4);
    for (std::size_t first = 0; first < scene.count(); first += kPiece) {
        const std::size_t count = std::min(kPiece, scene.count() - first);
        for (std::size_t i = 0; i < count; ++i) {
            pack_gaussian(scene, first + i, &gaussians[i * kGaussianFloats]);
            std::copy_n(&scene.sh[(first + i) * there], taken, &colors[i * quads * 4]);
        }
        const SetViews views = part(to.desc, to.views(), static_cast<std::uint32_t>(first),
                                    static_cast<std::uint32_t>(count));
        SPLAT_TRY(context.write(views.gaussians, gaussians.data(), count * kGaussianFloats * 4));
        SPLAT_TRY(context.write(views.colors, colors.data(), count * quads * 16));
    }
    return {};
}

Result<Downloaded> download(vk::Context& context, const SetDesc& desc, const SetViews& from,
                            bool all, double least) {
    SPLAT_ASSERT(!desc.direct_colors);
    const std::size_t stride = std::size_t{4} * desc.color_quads();
    std::vector<float> gaussians(std::size_t{from.count} * kGaussianFloats);
    std::vector<float> colors(from.count * stride);
    SPLAT_TRY(context.read(from.gaussians, gaussians.data(), gaussians.size() * sizeof(float)));
    SPLAT_TRY(context.read(from.colors, colors.data(), colors.size() * sizeof(float)));
    Downloaded made;
    made.gaussians.sh_degree = desc.sh_degree;
    for (std::size_t i = 0; i < from.count; ++i) {
        const std::span gaussian(&gaussians[i * kGaussianFloats], kGaussianFloats);
        const std::span color(&colors[i * stride], desc.color_floats());
        const bool invalid = !all && !valid(gaussian, color);
        // Scenes hold logits in float32: their opacity decides what is visible.
        const auto logit = static_cast<float>(scene::logit_of(static_cast<double>(gaussian[3])));
        const bool faint =
            !all && !invalid && scene::opacity_of(static_cast<double>(logit)) < least;
        made.not_finite += invalid ? 1 : 0;
        made.faint += faint ? 1 : 0;
        if (!invalid && !faint) append(made.gaussians, gaussian, color, logit);
    }
    return made;
}

}  // namespace splat::gaussians
