#include "io/scene_file.h"
#include "io/scene_formats.h"

#include <algorithm>
#include <cmath>

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

/// Errors: kInvalidArgument for what bytes cannot hold of Gaussian i, which is called `number`.
Status check(const Gaussians& g, std::size_t i, std::size_t number) {
    if (!all_finite(g.rotations, i, 4) || !all_finite(g.sh, i, 3) ||
        std::isnan(g.opacity_logits[i]))
        return invalid(
            "splat: Gaussian %zu has a rotation, opacity or colour that is not finite, "
            "which bytes cannot hold; remove it, or write .ply",
            number);
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
        if (loses_scale(g.log_scales[k]))
            return invalid(
                "splat: Gaussian %zu has a log scale of %g, whose exponential float32 "
                "cannot hold, expected about -103 to 88; remove it, or write .ply",
                number, static_cast<double>(g.log_scales[k]));
    return {};
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
    Gaussians gaussians = scene::reserve_gaussians(count, 0);
    for (std::size_t i = 0; i < count; ++i) {
        if (i % kSceneBlock == 0) {
            if (options.discard) discard(file.first(i * kBytesEach));
            scene::resize(gaussians, std::min(i + kSceneBlock, count));
        }
        decode(file.data() + i * kBytesEach, gaussians, i);
    }
    LoadReport report;
    return finish_load(std::move(gaussians), std::move(report), scene::Frame::kRdf, options);
}

Status put_splat(const Gaussians& gaussians, const SaveOptions& options, ByteSink& to) {
    SaveOptions flat = options;
    flat.sh_degree = 0;
    SPLAT_TRY(check_save(gaussians, flat));
    if (!options.sh_degree && gaussians.sh_degree > 0)
        log(LogLevel::kWarning,
            format("splat: harmonics of degree 1 to %u are not kept: the format has none",
                   gaussians.sh_degree));
    warn_of_loss("splat", clipped_colors(gaussians, scene::kSh0), 3 * gaussians.count(), kClipped);
    std::size_t bad_rotations = 0;
    Buffer rows;
    const auto put_block = [&](Gaussians& block, std::size_t first) -> Status {
        bad_rotations += scene::normalise_rotations(block);
        rows.clear();
        for (std::size_t i = 0; i < block.count(); ++i) {
            SPLAT_TRY(check(block, i, first + i));
            encode(rows, block, i);
        }
        return to.put(rows);
    };
    SPLAT_TRY(for_saved_blocks(gaussians, scene::Frame::kRdf, flat, put_block));
    warn_of_loss("splat", bad_rotations, gaussians.count(), "rotations have length 0");
    return {};
}

extern const SceneFormat kSplatFormat = {.id = 3,
                                         .name = "splat",
                                         .extension = ".splat",
                                         .holds = "8-bit colours without view dependence",
                                         .read = read_splat,
                                         .write = put_splat,
                                         .max_sh_degree = 0};

}  // namespace splat::io
