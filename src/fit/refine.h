#pragma once

#include "fit/photo_loss.h"
#include "fit/truths.h"
#include "io/weights_file.h"

namespace splat::fit {

/// What a step's loss says of a view that is refined.
struct ViewGradient {
    std::size_t view = 0;             ///< index among the photographs
    std::array<float, 12> pose = {};  ///< [3,4], by rotation and translation of world_to_camera
    std::array<double, 12> exposure = {};  ///< by the numbers of Exposure
};

/// Poses and exposures of the photographs of a fit, each of them optional: corrections that Adam moves on the host, of
/// the views of a step only.
///
/// A pose is corrected on the left of world_to_camera: the camera turns about its centre and moves along its own axes.
/// Turning and moving all cameras, scaling their distances and colouring all photographs would change the scene alone
/// (gauge), and photographs that are held out would no longer fit to it. So the cameras' mean turn, mean move and
/// scale, and the mean exposure, are held where they were given. All views count alike: a camera that is pinned may be
/// a bad one.
///
/// Precision    steps in float64, corrections and moments kept in float32
/// Determinism  bit-exact
/// Source       exposure: Kerbl et al. 2024, doi:10.1145/3658160
class Refinement {
  public:
    struct Desc {
        bool poses = false, exposure = false;
        double extent = 1;  ///< unit of moves, radius of the cameras
    };
    Refinement(const Desc& desc, std::span<const data::PosedPhoto> photos);

    [[nodiscard]] bool poses() const { return !poses_.empty(); }
    [[nodiscard]] bool any() const { return poses() || !exposures_.empty(); }

    /// The camera of a view, at any size, with its correction.
    [[nodiscard]] scene::Camera camera(std::size_t view, scene::Camera camera) const;
    /// Nothing if exposures are not refined.
    [[nodiscard]] std::optional<Exposure> exposure(std::size_t view) const;

    /// Move the views of a step. Those of gradients that are not finite stay.
    ///
    /// fraction     of the fit before the step; poses wait for the first fifth of it, until there is something to see
    void update(double fraction, std::span<const ViewGradient> gradients);

    /// Corrections and moments, by name; and back, all or nothing. Errors of load(): kInvalidArgument for other names
    /// or sizes.
    Status save(io::NamedTensors& tensors) const;
    Status load(const io::NamedTensors& tensors);

  private:
    /// Numbers of a view with their moments.
    template <std::size_t N>
    struct Refined {
        std::array<float, N> value{}, m{}, v{};
        float updates = 0;

        [[nodiscard]] std::array<double, N> step(const std::array<double, N>& gradient);
    };
    /// The vector part of the turn's unit quaternion, and the move.
    using Pose = Refined<6>;

    void move(const ViewGradient& gradient, double rate);
    void hold_poses();
    void hold_exposures();

    double extent_;
    std::vector<scene::Mat4> given_;   ///< world to camera
    std::vector<scene::Vec3> places_;  ///< centres of the given cameras, from their mean
    std::vector<Pose> poses_;
    std::vector<Refined<12>> exposures_;
};

}  // namespace splat::fit
