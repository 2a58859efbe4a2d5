#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/decode_budget.h"
#include "core/status.h"
#include "io/bytes.h"
#include "scene/frame.h"
#include "scene/gaussians.h"

namespace splat::io {

/// What was found in a scene file.
struct LoadReport {
    std::string format;                   ///< SceneFormat::name; read_scene() sets it
    std::uint32_t version = 0;            ///< version of the format, if it counts versions; else 0
    std::uint64_t count = 0;              ///< Gaussians
    std::uint32_t sh_degree = 0;          ///< in memory
    scene::Frame frame{};                 ///< axes of the file; in memory they are kRdf
    std::vector<std::string> ignored;     ///< properties, elements and bands that are ignored
    std::string left_out;                 ///< if lenient: what the header does not account for
    std::uint64_t non_finite_values = 0;  ///< NaN and infinities, kept as they are
    std::uint64_t bad_rotations = 0;      ///< quaternions of length 0 or not finite, kept
};

struct LoadedScene {
    scene::Gaussians gaussians;
    LoadReport report;
};

struct LoadOptions {
    std::optional<scene::Frame> frame;     ///< axes of the file, if not the format's usual ones
    std::uint64_t max_count = 1ULL << 27;  ///< more Gaussians are refused
    DecodeLimits limits = decode_limits();
    bool lenient = false;  ///< leave out what a header does not account for
};

struct SaveOptions {
    std::optional<scene::Frame> frame;       ///< for the file; nothing = the format's usual one
    std::optional<std::uint32_t> sh_degree;  ///< bands are dropped or padded; nothing = all
    std::uint32_t spz_version = 3;           ///< 3 or 4
    bool clamp = false;  ///< write scales that a format does not hold as the nearest
};

/// What a reader checks before it allocates the Gaussians that a header promises. Errors: kUnsupported for more
/// than the options allow; as DecodeBudget::take() for their memory.
Status check_count(std::uint64_t count, std::uint32_t sh_degree, const LoadOptions& options,
                   DecodeBudget& budget, const char* format);

/// The last step of every reader: rotations to length 1, into the frame of memory, and the counts of
/// the report. `usual` is the format's frame.
LoadedScene finish_load(scene::Gaussians gaussians, LoadReport report, scene::Frame usual,
                        const LoadOptions& options);

/// The first step of every writer: a copy with the degree and in the frame of the file. Errors:
/// kInvalidArgument for arrays that do not fit together, or a degree above the highest.
Result<scene::Gaussians> prepare_save(const scene::Gaussians& gaussians, scene::Frame usual,
                                      const SaveOptions& options);

/// Every value of a Gaussian is finite; the opacity logit may be infinite.
bool holds_numbers(const scene::Gaussians& gaussians, std::size_t i);

inline constexpr const char* kClipped = "colours are outside what a byte holds, and are clipped";

/// How many constant coefficients of colour are beyond a byte, which holds 255 (0.5 + scale sh) rounded.
std::size_t clipped_colors(const scene::Gaussians& gaussians, double scale);

/// Warns of `count` of `all` things, unless there are none: "spz: 3 of 40 colours are outside ...".
void warn_of_loss(const char* format, std::size_t count, std::size_t all, const char* what);

}  // namespace splat::io
