#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/status.h"

namespace splat::data {

/// A frame of CO3D's raw release. Boxes and points are pixels of its image.
struct RawFrame {
    std::int64_t number = 0;
    double time = 0;        ///< seconds
    std::size_t place = 0;  ///< in the list of the split
    std::string image;      ///< path below the folder of the release
    std::string mask;       ///< foreground probability, the same
    std::uint32_t width = 0, height = 0;
    std::optional<std::array<float, 4>> box;  ///< box of the foreground: left, top, width, height
    std::array<double, 9> rotation{};         ///< PyTorch3D: p_camera = p_world R + T
    std::array<double, 3> translation{};
    std::array<double, 2> focal{};            ///< pixels
    std::array<double, 2> principal_point{};  ///< pixels from the left and the top
};

struct RawSequence {
    std::string name;
    std::string points;            ///< path of its point cloud
    std::vector<RawFrame> frames;  ///< by time, then number
};

/// The sequences of a split of a subset such as "fewview_dev", by name: {root}/{category}/frame_annotations.jgz,
/// sequence_annotations.jgz and set_lists/set_lists_{subset}.json.
///
/// Errors   with the file: kNotFound, kIo; kFormat for damaged or incomplete annotations
/// Source   PyTorch3D's implicitron: JsonIndexDatasetMapProviderV2, GenericFrameDataBuilder
Result<std::vector<RawSequence>> read_raw_co3d(const std::string& root, const std::string& category,
                                               const std::string& subset, const std::string& split);

}  // namespace splat::data
