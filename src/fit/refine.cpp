#include "fit/refine.h"

#include <algorithm>
#include <cmath>

#include "scene/camera_pose.h"

namespace splat::fit {
namespace {

using scene::Mat3;
using scene::Quaternion;
using scene::Vec3;

// A view is seen in few steps, about 50 in a fit of a minute: in those it can turn by half a degree. Higher rates, and
// an earlier begin, moved cameras that were right by 0.05 degrees (COLMAP's of 50 photographs). The exposure's twelve
// numbers move together, so that a third of their published rate finds gains of 20 % as soon.
constexpr double kPosesFrom = 0.2;
constexpr double kPoseRate = 5e-4, kPoseRateAtEnd = 5e-5;  ///< radians, extents
constexpr double kExposureRate = 3e-3, kExposureRateAtEnd = 3e-4;
/// A view is seen in few steps, so its moments forget faster than those of Gaussians.
constexpr double kBeta1 = 0.9, kBeta2 = 0.99, kEps = 1e-15;

double decayed(double first, double last, double fraction) {
    return first * std::pow(last / first, fraction);
}

Vec3 vector_at(const std::array<float, 6>& numbers, std::size_t i) {
    return {numbers[i], numbers[i + 1], numbers[i + 2]};
}

void put(std::array<float, 6>& numbers, std::size_t i, const Vec3& value) {
    for (std::size_t k = 0; k < 3; ++k) numbers[i + k] = static_cast<float>(value[k]);
}

/// The turn of a correction, below half a circle.
Quaternion turn_of(const std::array<float, 6>& pose) {
    const Vec3 v = vector_at(pose, 0);
    return glm::normalize(Quaternion(std::sqrt(std::max(0.0, 1 - glm::dot(v, v))), v));
}

/// Turn a correction further, by a vector of radians.
void turn(std::array<float, 6>& pose, const Vec3& by) {
    const double angle = glm::length(by);
    const double share = angle > 0 ? std::sin(angle / 2) / angle : 0.5;
    Quaternion turned = Quaternion(std::cos(angle / 2), by * share) * turn_of(pose);
    if (turned.w < 0) turned = -turned;
    put(pose, 0, {turned.x, turned.y, turned.z});
}

template <class Numbers>
bool all_finite(const Numbers& numbers) {
    return std::ranges::all_of(numbers, [](auto number) { return std::isfinite(number); });
}

template <class Views>
Status add_to(io::NamedTensors& tensors, const char* name, const Views& views) {
    if (views.empty()) return {};
    io::NamedTensor tensor;
    tensor.name = name;
    const auto* const numbers = reinterpret_cast<const float*>(views.data());
    const std::size_t each = sizeof views[0] / sizeof(float);
    tensor.dims = {static_cast<std::int64_t>(views.size()), static_cast<std::int64_t>(each)};
    tensor.values.own().assign(numbers, numbers + views.size() * each);
    return tensors.add(std::move(tensor));
}

template <class Views>
Status take_from(const io::NamedTensors& tensors, const char* name, Views& views) {
    if (views.empty()) return {};
    const std::size_t each = sizeof views[0] / sizeof(float);
    const io::NamedTensor* const tensor = tensors.find(name);
    if (tensor == nullptr) return invalid("the state lacks '%s'", name);
    if (tensor->dims !=
        std::vector{static_cast<std::int64_t>(views.size()), static_cast<std::int64_t>(each)})
        return invalid("'%s' of the state has another shape, expected [%zu,%zu]", name,
                       views.size(), each);
    std::copy_n(tensor->values.data(), views.size() * each, reinterpret_cast<float*>(views.data()));
    return {};
}

}  // namespace

Refinement::Refinement(const Desc& desc, std::span<const data::PosedPhoto> photos)
    : extent_(desc.extent) {
    if (desc.exposure) exposures_.resize(photos.size());
    for (auto& view : exposures_) view.value = kNoExposure;
    if (!desc.poses) return;
    poses_.resize(photos.size());
    Vec3 mean(0);
    for (const data::PosedPhoto& photo : photos) {
        given_.push_back(photo.camera.world_to_camera);
        places_.push_back(scene::camera_center(photo.camera));
        mean += places_.back() / static_cast<double>(photos.size());
    }
    for (Vec3& place : places_) place -= mean;
}

scene::Camera Refinement::camera(std::size_t view, scene::Camera camera) const {
    if (!poses()) return camera;
    const std::array<float, 6>& pose = poses_[view].value;
    const Mat3 turned = glm::mat3_cast(turn_of(pose));
    scene::Mat4& matrix = camera.world_to_camera;
    matrix = scene::make_pose(turned * scene::rotation_of(matrix),
                              turned * scene::translation_of(matrix) + vector_at(pose, 3));
    return camera;
}

std::optional<Exposure> Refinement::exposure(std::size_t view) const {
    return exposures_.empty() ? std::nullopt : std::optional(exposures_[view].value);
}

/// A step of Adam (Kingma & Ba 2015) at a rate of 1.
template <std::size_t N>
std::array<double, N> Refinement::Refined<N>::step(const std::array<double, N>& gradient) {
    updates += 1;
    const auto turns = static_cast<double>(updates);
    std::array<double, N> change{};
    for (std::size_t k = 0; k < N; ++k) {
        const double g = gradient[k];
        const double mean = kBeta1 * static_cast<double>(m[k]) + (1 - kBeta1) * g;
        const double square = kBeta2 * static_cast<double>(v[k]) + (1 - kBeta2) * g * g;
        m[k] = static_cast<float>(mean);
        v[k] = static_cast<float>(square);
        change[k] = -mean / (1 - std::pow(kBeta1, turns)) /
                    (std::sqrt(square / (1 - std::pow(kBeta2, turns))) + kEps);
    }
    return change;
}

void Refinement::move(const ViewGradient& gradient, double rate) {
    Pose& pose = poses_[gradient.view];
    // By a turn w and a move d of the corrected pose [R|t], whose gradient is G: dL/dd is the last column of G, and
    // dL/dw the sum over the columns of column x gradient.
    scene::Camera now;
    now.world_to_camera = given_[gradient.view];
    now = camera(gradient.view, now);
    Vec3 spin(0), by(0);
    for (std::size_t column = 0; column < 4; ++column) {
        Vec3 at;
        for (std::size_t row = 0; row < 3; ++row) {
            at[row] = now.world_to_camera[4 * row + column];
            by[row] = static_cast<double>(gradient.pose[4 * row + column]);
        }
        spin += glm::cross(at, by);
    }
    by *= extent_;
    const std::array<double, 6> change = pose.step({spin.x, spin.y, spin.z, by.x, by.y, by.z});
    const Vec3 turned = rate * Vec3(change[0], change[1], change[2]);
    const Vec3 moved = vector_at(pose.value, 3) + glm::cross(turned, vector_at(pose.value, 3)) +
                       rate * extent_ * Vec3(change[3], change[4], change[5]);
    turn(pose.value, turned);
    put(pose.value, 3, moved);
}

/// Take away what all cameras have in common, in the world: their mean turn about the cameras' mean place, their mean
/// move, and what their moves scale.
void Refinement::hold_poses() {
    const auto count = static_cast<double>(poses_.size());
    const auto world_turn = [this](std::size_t i) {
        // The camera's axes turn by the inverse of the correction; to the first order, as it is small.
        return -2.0 * (vector_at(poses_[i].value, 0) * scene::rotation_of(given_[i]));
    };
    const auto world_move = [this](std::size_t i) {
        const Mat3 turned = glm::mat3_cast(turn_of(poses_[i].value));
        return -1.0 * (vector_at(poses_[i].value, 3) * (turned * scene::rotation_of(given_[i])));
    };
    Vec3 mean_turn(0), mean_move(0);
    double along = 0, size = 0;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
        const Vec3 move = world_move(i);
        mean_turn += world_turn(i) / count;
        mean_move += move / count;
        along += glm::dot(move, places_[i]);
        size += glm::dot(places_[i], places_[i]);
    }
    const double scale = size > 0 ? along / size : 0;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
        const Vec3 move =
            world_move(i) - glm::cross(mean_turn, places_[i]) - mean_move - scale * places_[i];
        turn(poses_[i].value, scene::rotation_of(given_[i]) * mean_turn);
        const Mat3 turned = glm::mat3_cast(turn_of(poses_[i].value));
        put(poses_[i].value, 3, -1.0 * (turned * scene::rotation_of(given_[i]) * move));
    }
}

/// Take away the mean exposure.
void Refinement::hold_exposures() {
    for (std::size_t k = 0; k < kNoExposure.size(); ++k) {
        double mean = 0;
        for (const auto& view : exposures_)
            mean += static_cast<double>(view.value[k]) / static_cast<double>(exposures_.size());
        const double more = mean - static_cast<double>(kNoExposure[k]);
        for (auto& view : exposures_)
            view.value[k] = static_cast<float>(static_cast<double>(view.value[k]) - more);
    }
}

void Refinement::update(double fraction, std::span<const ViewGradient> gradients) {
    if (!exposures_.empty()) {
        const double rate = decayed(kExposureRate, kExposureRateAtEnd, fraction);
        for (const ViewGradient& gradient : gradients) {
            if (!all_finite(gradient.exposure)) continue;
            auto& view = exposures_[gradient.view];
            const std::array<double, 12> change = view.step(gradient.exposure);
            for (std::size_t k = 0; k < change.size(); ++k)
                view.value[k] =
                    static_cast<float>(static_cast<double>(view.value[k]) + rate * change[k]);
        }
        hold_exposures();
    }
    if (!poses() || fraction < kPosesFrom) return;
    const double rate = decayed(kPoseRate, kPoseRateAtEnd, fraction);
    for (const ViewGradient& gradient : gradients)
        if (all_finite(gradient.pose)) move(gradient, rate);
    hold_poses();
}

Status Refinement::save(io::NamedTensors& tensors) const {
    SPLAT_TRY(add_to(tensors, "poses", poses_));
    return add_to(tensors, "exposures", exposures_);
}

Status Refinement::load(const io::NamedTensors& tensors) {
    std::vector<Pose> poses = poses_;
    auto exposures = exposures_;
    SPLAT_TRY(take_from(tensors, "poses", poses));
    SPLAT_TRY(take_from(tensors, "exposures", exposures));
    poses_ = std::move(poses);
    exposures_ = std::move(exposures);
    return {};
}

}  // namespace splat::fit
