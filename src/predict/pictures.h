#pragma once

#include <optional>
#include <span>

#include "data/photograph.h"
#include "predict/view_source.h"

namespace splat::predict {

/// One view of an object as input of a network.
struct PictureInput {
    data::Picture picture;
    bool crop = true;          ///< see data::CutOptions
    double foreground = 0.65;  ///< see data::CutOptions
    double focal = 0;          ///< pixels of the picture; 0: not known
    double origin_distance =
        0;  ///< from the camera along its axis, scene units; for networks that take it
    std::optional<scene::Mat4> world_to_camera;  ///< required of every picture if there are several
    std::vector<float> embedding, tokens;        ///< see Views
};

/// What became of a picture.
struct PictureFacts {
    std::uint32_t width = 0, height = 0;
    bool whole = false;      ///< not cut out
    bool at_border = false;  ///< the object reaches the picture's border
    data::MaskFrom found = data::MaskFrom::kNothing;
    double x = 0, y = 0, side = 0;  ///< the square that was cut out, pixels of the picture
    double focal = 0;               ///< pixels of the picture; 0: not known
    double fov_degrees = 0;         ///< field of view of the square; 0: not known
};

PictureFacts facts_of(const data::Photograph& photo, const PictureInput& given);

struct PictureViews {
    Views views;  ///< all are input views; the cameras are those of the squares
    std::vector<PictureFacts> facts;
};

/// True for a network with the depth of each pixel in scene units: its pictures are taken whole, over the background
/// only where a mask or an alpha is given.
bool takes_whole_pictures(const config::ModelConfig& network);

/// Cut the pictures out as a network takes them, with cameras relative to the first. Messages call them
/// pictures[0] and so on.
///
/// A network with a field of view (data.fov) sees each picture through it; focal lengths are then only
/// compared. Several views must be whole pictures, because their poses belong to these.
///
/// Errors  kInvalidArgument, naming the picture and what is missing or not used: another number of
///         pictures, maps, focal lengths, poses, origin distances; those of data::cut_photograph
Result<PictureViews> views_of_pictures(const config::ModelConfig& network,
                                       const std::array<float, 3>& background,
                                       std::span<const PictureInput> pictures);

/// A picture taken with a field of view that differs from the network's by more than this factor is worth a
/// warning: its perspective is not that of the training.
inline constexpr double kFieldOfViewFactor = 1.5;

/// True if the square's field of view is known, and differs from the network's by more.
bool field_of_view_differs(const config::ModelConfig& network, const PictureFacts& facts);

}  // namespace splat::predict
