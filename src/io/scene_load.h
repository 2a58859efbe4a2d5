#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/decode_budget.h"
#include "core/parallel.h"
#include "core/status.h"
#include "io/file.h"
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
    scene::DrawnAs drawn_as;
};

struct LoadedScene {
    scene::Gaussians gaussians;
    LoadReport report;
};

/// What a file promises before its Gaussians are read.
struct SceneHead {
    std::uint64_t count = 0;      ///< Gaussians
    std::uint32_t sh_degree = 0;  ///< degree that they would have in memory
};

struct LoadOptions {
    std::optional<scene::Frame> frame;     ///< axes of the file, if not the format's usual ones
    std::uint64_t max_count = 1ULL << 27;  ///< more Gaussians are refused
    DecodeLimits limits = decode_limits();
    bool lenient = false;  ///< leave out what a header does not account for
    /// The file is a Buffer of the caller, who does not need it any more: readers of binary .ply and of .splat give
    /// its pages back as they go, so that file and Gaussians are not both in memory.
    bool discard = false;
    /// If not null, check_count() fills it and fails, so that nothing else is read.
    SceneHead* head = nullptr;
    /// Where the files are that a document names; nothing: such documents are refused.
    std::optional<std::string> folder;
};

struct SaveOptions {
    std::optional<scene::Frame> frame;       ///< for the file; nothing = the format's usual one
    std::optional<std::uint32_t> sh_degree;  ///< bands are dropped or padded; nothing = all
    std::uint32_t spz_version = 3;           ///< 3 or 4
    bool clamp = false;  ///< write scales that a format does not hold as the nearest
    /// for writers that take long; the bits do not depend on it
    std::size_t threads = kMostHostThreads;
};

/// What a reader checks before it allocates the Gaussians that a header promises. Errors: kUnsupported for more
/// than the options allow; as DecodeBudget::take() for their memory; kCancelled if options.head is not null.
Status check_count(std::uint64_t count, std::uint32_t sh_degree, const LoadOptions& options,
                   DecodeBudget& budget, const char* format);

/// The last step of every reader: rotations to length 1, into the frame of memory, and the counts of
/// the report. `usual` is the format's frame.
LoadedScene finish_load(scene::Gaussians gaussians, LoadReport report, scene::Frame usual,
                        const LoadOptions& options);

/// Gaussians that readers and writers take at a time.
inline constexpr std::size_t kSceneBlock = 65536;

/// Gives whole pages of `read`, a part of a Buffer, back to the system; the bytes are lost.
void discard(Bytes read);

/// Errors: kInvalidArgument for arrays that do not fit together, or a degree to write above the highest.
Status check_save(const scene::Gaussians& gaussians, const SaveOptions& options);

/// The first step of a writer: a copy with the degree and in the frame of the file. Errors: as check_save().
Result<scene::Gaussians> prepare_save(const scene::Gaussians& gaussians, scene::Frame usual,
                                      const SaveOptions& options);

/// The same for a writer that takes no copy of the whole scene: calls work(block, first) with the Gaussians from
/// Gaussian `first` on, at most kSceneBlock of them. Errors: as check_save(), and those of `work`.
Status for_saved_blocks(
    const scene::Gaussians& gaussians, scene::Frame usual, const SaveOptions& options,
    const std::function<Status(scene::Gaussians& block, std::size_t first)>& work);
/// A finite log scale whose exponential is 0 or infinite as a float32.
bool loses_scale(float log_scale);

/// Every value of a Gaussian is finite; the opacity logit may be infinite.
bool holds_numbers(const scene::Gaussians& gaussians, std::size_t i);

/// What writers of quantised formats check of a scene, or of the block that begins with Gaussian `first`. Errors:
/// kInvalidArgument naming the first Gaussian that does not hold numbers.
Status check_numbers(const scene::Gaussians& gaussians, const char* format, std::size_t first = 0);

/// What a report says of the bands of a file above kMaxShDegree, which are not read.
std::string dropped_bands(std::uint32_t file_degree);

inline constexpr const char* kClipped = "colours are outside what a byte holds, and are clipped";

/// How many constant coefficients of colour are beyond a byte, which holds 255 (0.5 + scale sh) rounded.
std::size_t clipped_colors(const scene::Gaussians& gaussians, double scale);

/// Warns of `count` of `all` things, unless there are none: "spz: 3 of 40 colours are outside ...".
void warn_of_loss(const char* format, std::size_t count, std::size_t all, const char* what);

/// Warns of what a scene says of drawing it, and a file of the format does not, and of what every such file says;
/// `says` and `always` are those of SceneFormat.
void warn_of_drawing(const char* format, const scene::DrawnAs& scene, const scene::DrawnAs& says,
                     const scene::DrawnAs& always);

}  // namespace splat::io
