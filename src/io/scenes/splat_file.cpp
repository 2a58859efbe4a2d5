#include "io/scene_file.h"
#include "io/scene_formats.h"

#include <cmath>
#include <limits>

#include "core/log.h"
#include "io/bytes.h"
#include "io/reader.h"
#include "scene/arrays.h"
#include "scene/sh.h"

namespace splat::io {
namespace {

using scene::Gaussians;

constexpr std::size_t kBytesEach = 32;

void decode(const std::byte* at, Gaussians& g, std::size_t i) {
    const auto byte = [at](std::size_t offset) {
        return std::to_integer<std::uint8_t>(at[offset]);
    };
    for (std::size_t k = 0; k < 3; ++k) {
        g.means[i * 3 + k] = number<float>(at + 4 * k);
        g.log_scales[i * 3 + k] =
            static_cast<float>(std::log(static_cast<double>(number<float>(at + 12 + 4 * k))));
        g.sh[i * 3 + k] = static_cast<float>((byte(24 + k) / 255.0 - 0.5) / scene::kSh0);
    }
    g.opacity_logits[i] = opacity_logit(byte(27));
    for (std::size_t k = 0; k < 4; ++k)
        g.rotations[i * 4 + k] = static_cast<float>((byte(28 + k) - 128) / 128.0);
}

/// Finite, but its exponential is 0 or infinite as a float32.
bool is_lost(float log_scale) {
    const double scale = std::exp(static_cast<double>(log_scale));
    return std::isfinite(log_scale) &&
           (scale > static_cast<double>(std::numeric_limits<float>::max()) ||
            static_cast<float>(scale) == 0);
}

void encode(Buffer& to, const Gaussians& g, std::size_t i) {
    for (std::size_t k = 0; k < 3; ++k) put(to, g.means[i * 3 + k]);
    for (std::size_t k = 0; k < 3; ++k)
        put(to, static_cast<float>(std::exp(static_cast<double>(g.log_scales[i * 3 + k]))));
    for (std::size_t k = 0; k < 3; ++k)
        put(to, to_byte(255 * (0.5 + scene::kSh0 * static_cast<double>(g.sh[i * 3 + k]))));
    put(to, opacity_byte(g.opacity_logits[i]));
    for (std::size_t k = 0; k < 4; ++k)
        put(to, to_byte(128 + 128 * static_cast<double>(g.rotations[i * 4 + k])));
}

}  // namespace

Result<LoadedScene> read_splat(Bytes file, const LoadOptions& options) {
    const std::size_t count = file.size() / kBytesEach;
    if (file.size() % kBytesEach != 0)
        return damaged(
            "splat: %zu bytes, expected a multiple of 32; %zu bytes follow Gaussian %zu. The "
            "file is truncated or of another format",
            file.size(), file.size() % kBytesEach, count);
    DecodeBudget budget(file.size(), options.limits);
    SPLAT_TRY(check_count(count, 0, options, budget, "splat"));
    Gaussians gaussians = scene::make_gaussians(count, 0);
    for (std::size_t i = 0; i < count; ++i) decode(file.data() + i * kBytesEach, gaussians, i);
    LoadReport report;
    return finish_load(std::move(gaussians), std::move(report), scene::Frame::kRdf, options);
}

Result<Buffer> write_splat(const Gaussians& gaussians, const SaveOptions& options) {
    SaveOptions flat = options;
    flat.sh_degree = 0;
    SPLAT_ASSIGN(Gaussians scene, prepare_save(gaussians, scene::Frame::kRdf, flat));
    const std::size_t bad_rotations = scene::normalise_rotations(scene);
    if (!options.sh_degree && gaussians.sh_degree > 0)
        log(LogLevel::kWarning,
            format("splat: harmonics of degree 1 to %u are not kept: the format has none",
                   gaussians.sh_degree));
    warn_of_loss("splat", clipped_colors(scene, scene::kSh0), scene.sh.size(), kClipped);
    warn_of_loss("splat", bad_rotations, scene.count(), "rotations have length 0");
    Buffer file;
    file.reserve(scene.count() * kBytesEach);
    for (std::size_t i = 0; i < scene.count(); ++i) {
        if (!all_finite(scene.rotations, i, 4) || !all_finite(scene.sh, i, 3) ||
            std::isnan(scene.opacity_logits[i]))
            return invalid(
                "splat: Gaussian %zu has a rotation, opacity or colour that is not finite, "
                "which bytes cannot hold; remove it, or write .ply",
                i);
        for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
            if (is_lost(scene.log_scales[k]))
                return invalid(
                    "splat: Gaussian %zu has a log scale of %g, whose exponential float32 "
                    "cannot hold, expected about -103 to 88; remove it, or write .ply",
                    i, static_cast<double>(scene.log_scales[k]));
        encode(file, scene, i);
    }
    return file;
}

extern const SceneFormat kSplatFormat = {.id = 3,
                                         .name = "splat",
                                         .extension = ".splat",
                                         .holds = "8-bit colours without view dependence",
                                         .read = read_splat,
                                         .write = write_splat,
                                         .max_sh_degree = 0};

}  // namespace splat::io
