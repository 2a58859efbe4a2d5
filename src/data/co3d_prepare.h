#pragma once

#include <functional>

#include "data/co3d_raw.h"

namespace splat::data {

struct Co3dPreparation {
    std::string raw;       ///< folder of the release
    std::string out;       ///< folder to write to
    std::string category;  ///< "hydrant"
    std::string subset = "fewview_dev";
    std::string split = "train";
    std::uint32_t size = 128;   ///< pixels
    std::uint32_t limit = 0;    ///< sequences, the first by name; 0: all
    bool stored_poses = false;  ///< keep the release's cameras instead of normalised ones
};

struct Co3dPrepared {
    std::uint32_t sequences = 0;
    std::uint32_t kept = 0;      ///< sequences that were there before
    std::uint32_t left_out = 0;  ///< sequences left out: their cameras are not finite
    std::uint64_t frames = 0;
};

/// Writes {out}/co3d_{category}_for_gs/{split}/ as open_co3d() reads it, with masks.npy besides the published files.
/// Sequences that are there are kept, so that an interrupted run can be repeated. Sequences run in parallel;
/// `progress` is called with the number done, on any thread. prepared.json holds size, subset and kind of poses.
///
/// Errors   kInvalidArgument for the preparation, or a folder of another one; with the file, as read_raw_co3d();
///          kFormat, kNotFound for images, masks and points; as write_file()
/// Source   preprocessing of CO3D of Splatter Image
Result<Co3dPrepared> prepare_co3d(const Co3dPreparation& preparation,
                                  const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace splat::data
