#include "scene/camera_path.h"

#include <algorithm>

#include "scene/camera_pose.h"

namespace splat::scene {
namespace {

/// Where a camera is and how it is turned to the world.
struct Key {
    Vec3 center;
    Quaternion turn;
};

double angle_between(const Quaternion& a, const Quaternion& b) {
    return 2 * std::acos(std::min(std::abs(glm::dot(a, b)), 1.0));
}

/// Angles of equal rotations are the rounding of arc cosines.
bool same(const Key& a, const Key& b) {
    return a.center == b.center && angle_between(a.turn, b.turn) < 1e-7;
}

Key key_of(const Camera& camera) {
    const Mat3 turn = glm::transpose(rotation_of(camera.world_to_camera));
    return {camera_center(camera), glm::normalize(glm::quat_cast(turn))};
}

/// Lengths of the ways from each key to the next one: distance and angle, each in means over the path.
std::vector<double> lengths_of(const std::vector<Key>& keys) {
    std::vector<double> distances, angles;
    double distance = 0, angle = 0;
    for (std::size_t i = 0; i + 1 < keys.size(); ++i) {
        distances.push_back(glm::length(keys[i + 1].center - keys[i].center));
        angles.push_back(angle_between(keys[i + 1].turn, keys[i].turn));
        distance += distances.back();
        angle += angles.back();
    }
    std::vector<double> lengths(distances.size());
    const auto steps = static_cast<double>(lengths.size());
    for (std::size_t i = 0; i < lengths.size(); ++i)
        lengths[i] = (distance > 0 ? distances[i] * steps / distance : 0) +
                     (angle > 0 ? angles[i] * steps / angle : 0);
    return lengths;
}

/// A curve of vectors or quaternions through `values`, each `lengths[i]` after the one before.
template <class T>
class Curve {
  public:
    Curve(std::vector<T> values, const std::vector<double>& lengths)
        : values_(std::move(values)), lengths_(lengths) {
        const std::size_t last = values_.size() - 1;
        const auto step = [&](std::size_t i) {
            return (values_[i + 1] - values_[i]) * (1 / lengths[i]);
        };
        slopes_.resize(values_.size());
        for (std::size_t i = 1; i < last; ++i)
            slopes_[i] = (step(i - 1) * lengths[i] + step(i) * lengths[i - 1]) *
                         (1 / (lengths[i - 1] + lengths[i]));
        slopes_[0] = last > 1 ? step(0) * 2.0 - slopes_[1] : step(0);
        slopes_[last] = last > 1 ? step(last - 1) * 2.0 - slopes_[last - 1] : step(0);
    }

    /// u   0 to 1, from value i to the next one
    [[nodiscard]] T at(std::size_t i, double u) const {
        const double v = 1 - u;
        return values_[i] * ((1 + 2 * u) * v * v) + slopes_[i] * (u * v * v * lengths_[i]) +
               values_[i + 1] * (u * u * (3 - 2 * u)) - slopes_[i + 1] * (u * u * v * lengths_[i]);
    }

  private:
    std::vector<T> values_, slopes_;
    const std::vector<double>& lengths_;
};

}  // namespace

Result<std::vector<Camera>> camera_path(std::span<const Camera> keys, std::uint32_t count,
                                        bool closed) {
    std::vector<Key> places;
    for (const Camera& camera : keys) {
        const Key key = key_of(camera);
        if (places.empty() || !same(key, places.back())) places.push_back(key);
    }
    if (closed && places.size() > 2 && same(places.front(), places.back())) places.pop_back();
    if (places.size() < 2)
        return invalid("a path through %zu different poses, expected at least two", places.size());
    std::size_t first = 0, last = places.size() - 1;
    if (closed) {  // a neighbour beyond each end
        places.insert(places.begin(), places.back());
        places.push_back(places[1]);
        places.push_back(places[2]);
        first = 1;
        last = places.size() - 2;
    }
    const std::vector<double> lengths = lengths_of(places);
    std::vector<Vec3> centers;
    std::vector<Quaternion> turns;
    for (const Key& key : places) {
        centers.push_back(key.center);
        const bool far = !turns.empty() && glm::dot(turns.back(), key.turn) < 0;
        turns.push_back(far ? -key.turn : key.turn);  // the shorter way round
    }
    const Curve center_at(std::move(centers), lengths);
    const Curve turn_at(std::move(turns), lengths);
    double whole = 0;
    for (std::size_t i = first; i < last; ++i) whole += lengths[i];
    const std::uint32_t steps = closed ? count : std::max(count, 2U) - 1;
    std::vector<Camera> cameras;
    std::size_t i = first;
    double begin = 0;  // where the part from key i to the next one begins
    for (std::uint32_t frame = 0; frame < count; ++frame) {
        const double place = whole * frame / steps;
        while (i + 1 < last && place >= begin + lengths[i]) begin += lengths[i++];
        const double u = std::min((place - begin) / lengths[i], 1.0);
        const Mat3 rotation = glm::transpose(glm::mat3_cast(glm::normalize(turn_at.at(i, u))));
        Camera camera = keys.front();
        camera.name = format("%04u", frame);
        camera.world_to_camera = make_pose(rotation, -(rotation * center_at.at(i, u)));
        cameras.push_back(std::move(camera));
    }
    return cameras;
}

}  // namespace splat::scene
