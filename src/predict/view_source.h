#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/config_keys.h"
#include "core/status.h"
#include "data/dataset.h"
#include "data/view_vectors.h"
#include "scene/camera.h"
#include "scene/vector.h"

namespace splat::predict {

/// Views of one object, in the frame of the first.
struct Views {
    std::vector<float> inputs;                              ///< [n,channels,R,R] of the input views
    std::vector<float> images;                              ///< [n,3,R,R]
    std::vector<std::uint8_t> levels;                       ///< the same, 0 to 255; or empty
    std::vector<float> view_to_world, quaternions, focals;  ///< see data::ViewArrays
    std::vector<float> embedding,
        tokens;                 ///< for the input views, see model::ModelInput; or empty
    std::vector<float> planes;  ///< [n,5,R,R] of the input views, where a loss takes them
    std::vector<scene::Camera> cameras;
};

/// A data set that a network of a configuration reads. Thread-safe.
class ViewSource {
  public:
    /// A split of the data set of a configuration; `root`, unless empty, replaces data.root. Errors:
    /// kInvalidArgument if neither names a folder; those of Dataset::open, with DatasetDesc::lacks_split.
    static Result<std::shared_ptr<data::Dataset>> open_split(const config::Settings& settings,
                                                             const std::string& root,
                                                             const std::string& split,
                                                             bool* lacks_split = nullptr);

    /// Open such a split with its vectors. Errors: as above; kInvalidArgument if the network takes an
    /// embedding or tokens whose file the configuration does not name; those of ViewVectors::load.
    static Result<std::unique_ptr<ViewSource>> open(const config::Settings& settings,
                                                    const std::string& root,
                                                    const std::string& split);

    /// Take a data set that is already open; data.root, format and subset are not used. Errors:
    /// kInvalidArgument, naming the key, if its resolution, its background or its maps are not
    /// those of the configuration; as above for vectors.
    static Result<std::unique_ptr<ViewSource>> open(const config::Settings& settings,
                                                    std::shared_ptr<data::Dataset> dataset);

    [[nodiscard]] std::uint32_t objects() const {
        return static_cast<std::uint32_t>(dataset_->index().names.size());
    }
    [[nodiscard]] const std::string& name(std::uint32_t object) const {
        return dataset_->index().names[object];
    }
    [[nodiscard]] std::uint32_t views_of(std::uint32_t object) const {
        return dataset_->index().views_of[object];
    }
    [[nodiscard]] std::uint32_t resolution() const { return dataset_->resolution(); }
    [[nodiscard]] data::Dataset& dataset() const { return *dataset_; }

    /// The views with these numbers, in this order; inputs for the first `inputs` of them. With
    /// `levels` those are given, and images of the inputs alone. Errors: those of Dataset::read.
    [[nodiscard]] Result<Views> read(std::uint32_t object, std::span<const std::uint32_t> views,
                                     std::uint32_t inputs, bool levels = false) const;

    /// A sentence if a view of the first `objects` objects (each data::check_stride-th of many) has a field of view
    /// that differs from data.fov by more than 1 %: the network's rays are not those of its images. Else empty.
    /// Errors: those of Dataset::read.
    [[nodiscard]] Result<std::string> field_of_view_warning(std::uint32_t objects) const;

    /// A sentence if data.znear to data.zfar cannot hold the scenes, of some objects; else empty. Errors: those of
    /// data::depth_range_warning().
    [[nodiscard]] Result<std::string> depth_range_warning() const;

  private:
    ViewSource(const config::Settings& settings, std::shared_ptr<data::Dataset> dataset);
    static Result<std::unique_ptr<ViewSource>> make(const config::Settings& settings,
                                                    std::shared_ptr<data::Dataset> dataset,
                                                    const std::string& root);

    config::ModelConfig network_;
    bool gives_planes_;
    std::shared_ptr<data::Dataset> dataset_;
    std::optional<data::ViewVectors> embedding_, tokens_;  ///< where the network takes them
};

/// The inverse of a rigid pose, given as a matrix for row vectors, in the form of world_to_camera.
scene::Mat4 inverse_pose(const float* view_to_world);

/// The settings without losses that take more maps than the network sees, as predictions need them.
config::Settings without_map_losses(config::Settings settings);

/// The colour behind objects: white or black.
std::array<float, 3> background_of(const config::Settings& settings);

}  // namespace splat::predict
