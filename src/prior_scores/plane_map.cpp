#include "prior_scores/plane_map.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <numbers>
#include <numeric>

#include "prior_scores/check_map.h"

namespace splat::prior_scores {
namespace {

using scene::Mat3;
using scene::Vec3;

constexpr double kLeastNormal = 0.5;     ///< length of a normal
constexpr std::uint64_t kFirstFit = 16;  ///< points of the first plane by least squares

/// The unit eigenvector of the least eigenvalue of a symmetric matrix, by Jacobi's rotations in a fixed order (Golub
/// and Van Loan, Matrix Computations, section 8.5). Eight sweeps leave nothing of float64 off the diagonal.
Vec3 least_axis(Mat3 m) {
    Mat3 axes(1.0);
    for (int turn = 0; turn < 8 * 3; ++turn) {
        const auto p = static_cast<std::size_t>(turn % 3 == 2 ? 1 : 0);
        const auto q = static_cast<std::size_t>(turn % 3 == 0 ? 1 : 2);
        if (m[p][q] == 0) continue;
        const double tau = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double t = (tau < 0 ? -1 : 1) / (std::abs(tau) + std::sqrt(1 + tau * tau));
        Mat3 j(1.0);
        j[p][p] = j[q][q] = 1 / std::sqrt(1 + t * t);
        j[q][p] = t * j[p][p];
        j[p][q] = -j[q][p];
        m = glm::transpose(j) * m * j;
        axes = axes * j;
    }
    std::size_t least = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (m[k][k] < m[least][least]) least = k;
    return axes[least];
}

/// Pixels of one plane.
struct Region {
    std::uint64_t count = 0;
    Vec3 points{}, facing{};  ///< sums of points and normals
    Mat3 squares{0.0};        ///< sum of p p^T
    Vec3 center{}, normal{};  ///< the plane
    std::size_t first = 0;    ///< least pixel

    void add(std::size_t pixel, const Vec3& point, const Vec3& unit) {
        first = count == 0 ? pixel : std::min(first, pixel);
        ++count;
        points += point;
        facing += unit;
        squares += glm::outerProduct(point, point);
    }
    void add(const Region& other) {
        first = std::min(first, other.first);
        count += other.count;
        points += other.points;
        facing += other.facing;
        squares += other.squares;
    }

    /// The normal of least squares counts where it agrees with the mean one, unlike that of points on a line.
    void fit(double cosine) {
        const auto n = static_cast<double>(count);
        center = points / n;
        normal = glm::normalize(facing);
        if (count < kFirstFit) return;
        Vec3 axis = least_axis(squares / n - glm::outerProduct(center, center));
        if (glm::dot(axis, normal) < 0) axis = -axis;
        if (glm::dot(axis, normal) >= cosine) normal = axis;
    }
    [[nodiscard]] double offset(const Vec3& point) const {
        return std::abs(glm::dot(normal, point - center));
    }
};

class Finder {
  public:
    Finder(std::span<const float> depth, std::span<const float> normals,
           const scene::Camera& camera, const PlaneRules& rules)
        : depth_(depth),
          normals_(normals),
          camera_(camera),
          rules_(rules),
          cosine_(std::cos(rules.degrees * std::numbers::pi / 180)),
          least_(static_cast<std::uint64_t>(
              std::ceil(rules.least * static_cast<double>(depth.size())))),
          ids_(depth.size(), 0) {}

    PlaneMap find() {
        for (const std::uint32_t seed : by_flatness())
            if (ids_[seed] == 0) grow(seed);
        become_.resize(regions_.size());
        std::iota(become_.begin(), become_.end(), 0);
        merge();
        keep_the_largest();
        take_what_lies_on_them();
        keep_the_largest();  // some have grown
        PlaneMap map{std::move(ids_), {}};
        for (const Region& region : regions_)
            map.planes.push_back(
                {region.normal, -glm::dot(region.normal, region.center), region.count});
        return map;
    }

  private:
    static constexpr std::uint32_t kDropped =
        UINT32_MAX;  ///< marks pixels of a region that was too small

    [[nodiscard]] double z(std::size_t i) const { return static_cast<double>(depth_[i]); }
    [[nodiscard]] Vec3 point(std::size_t i) const {
        return z(i) * Vec3((static_cast<double>(i % camera_.width) + 0.5 - camera_.cx) / camera_.fx,
                           (static_cast<double>(i / camera_.width) + 0.5 - camera_.cy) / camera_.fy,
                           1);
    }
    /// The unit normal that faces the camera; 0: none.
    [[nodiscard]] Vec3 unit(std::size_t i) const {
        const Vec3 n(static_cast<double>(normals_[3 * i]), static_cast<double>(normals_[3 * i + 1]),
                     static_cast<double>(normals_[3 * i + 2]));
        const double length = glm::length(n);
        if (!(z(i) > 0) || length < kLeastNormal) return {};
        return (glm::dot(n, point(i)) > 0 ? -1 : 1) / length * n;
    }

    template <class Visit>
    void for_neighbours(std::size_t i, Visit&& visit) const {
        const std::size_t w = camera_.width, x = i % w;
        if (i >= w) visit(i - w);
        if (x > 0) visit(i - 1);
        if (x + 1 < w) visit(i + 1);
        if (i + w < depth_.size()) visit(i + w);
    }

    /// Pixels with a normal, those first whose neighbours lie on their plane and face as they do.
    [[nodiscard]] std::vector<std::uint32_t> by_flatness() const {
        std::vector<float> bend(depth_.size(), 0);
        std::vector<std::uint32_t> order;
        for (std::size_t i = 0; i < depth_.size(); ++i) {
            const Vec3 n = unit(i);
            if (n == Vec3{}) continue;
            order.push_back(static_cast<std::uint32_t>(i));
            double worst = 0;
            for_neighbours(i, [&](std::size_t j) {
                const Vec3 other = unit(j);
                const double off = std::abs(glm::dot(n, point(j) - point(i))) / z(i);
                worst = std::max(worst, other == Vec3{} ? 1 : off + 1 - glm::dot(n, other));
            });
            bend[i] = static_cast<float>(worst);
        }
        std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return bend[i]; });
        return order;
    }

    void grow(std::uint32_t seed) {
        Region region;
        region.add(seed, point(seed), unit(seed));
        region.fit(cosine_);
        const auto id = static_cast<std::uint32_t>(regions_.size() + 1);
        std::vector<std::uint32_t> taken = {seed};
        ids_[seed] = id;
        for (std::size_t at = 0; at < taken.size(); ++at)
            for_neighbours(taken[at], [&](std::size_t j) {
                if (ids_[j] != 0) return;
                const Vec3 n = unit(j), p = point(j);
                if (n == Vec3{} || glm::dot(n, region.normal) < cosine_ ||
                    region.offset(p) > rules_.offset * z(j))
                    return;
                ids_[j] = id;
                taken.push_back(static_cast<std::uint32_t>(j));
                region.add(j, p, n);
                if (region.count <= kFirstFit || std::has_single_bit(region.count))
                    region.fit(cosine_);
            });
        region.fit(cosine_);
        // A part of a plane may be smaller than the plane.
        if (region.count >= std::max(kFirstFit, least_ / 4)) return regions_.push_back(region);
        for (const std::uint32_t i : taken) ids_[i] = kDropped;
    }

    [[nodiscard]] bool are_one(const Region& a, const Region& b) const {
        return glm::dot(a.normal, b.normal) >= cosine_ &&
               a.offset(b.center) <= rules_.offset * b.center.z &&
               b.offset(a.center) <= rules_.offset * a.center.z;
    }

    void merge() {
        std::vector<std::size_t> order = become_;
        std::ranges::stable_sort(order, std::greater<>{},
                                 [&](std::size_t i) { return regions_[i].count; });
        for (std::size_t a = 0; a < order.size(); ++a) {
            Region& large = regions_[order[a]];
            for (std::size_t b = a + 1; b < order.size() && large.count > 0; ++b) {
                Region& small = regions_[order[b]];
                if (small.count == 0 || !are_one(large, small)) continue;
                large.add(small);
                large.fit(cosine_);
                small.count = 0;
                become_[order[b]] = order[a];
            }
        }
    }

    /// Number the regions anew, those that have grown into others as these.
    void keep_the_largest() {
        std::vector<std::size_t> order;
        for (std::size_t i = 0; i < regions_.size(); ++i)
            if (regions_[i].count >= least_ && glm::dot(regions_[i].normal, regions_[i].center) < 0)
                order.push_back(i);
        std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
            return regions_[a].count != regions_[b].count ? regions_[a].count > regions_[b].count
                                                          : regions_[a].first < regions_[b].first;
        });
        order.resize(std::min(order.size(), kMostPlanes));
        std::vector<std::uint32_t> id(regions_.size(), 0);
        std::vector<Region> kept;
        for (const std::size_t i : order) {
            kept.push_back(regions_[i]);
            id[i] = static_cast<std::uint32_t>(kept.size());
        }
        for (std::uint32_t& pixel : ids_)
            pixel = pixel == 0 || pixel == kDropped ? 0 : id[become_[pixel - 1]];
        regions_ = std::move(kept);
        become_.resize(regions_.size());
        std::iota(become_.begin(), become_.end(), 0);
    }

    /// Their normals may be wrong, as beside edges, so that only their points count; the planes stay.
    void take_what_lies_on_them() {
        std::vector<std::uint32_t> taken;
        for (std::size_t i = 0; i < ids_.size(); ++i)
            if (ids_[i] != 0) taken.push_back(static_cast<std::uint32_t>(i));
        for (std::size_t at = 0; at < taken.size(); ++at)
            for_neighbours(taken[at], [&](std::size_t j) {
                Region& region = regions_[ids_[taken[at]] - 1];
                if (ids_[j] != 0 || !(z(j) > 0) || region.offset(point(j)) > rules_.offset * z(j))
                    return;
                ids_[j] = ids_[taken[at]];
                ++region.count;
                region.first = std::min(region.first, j);
                taken.push_back(static_cast<std::uint32_t>(j));
            });
    }

    std::span<const float> depth_, normals_;
    const scene::Camera& camera_;
    const PlaneRules& rules_;
    double cosine_;
    std::uint64_t least_;
    std::vector<std::uint32_t> ids_;
    std::vector<Region> regions_;
    std::vector<std::size_t> become_;  ///< the region that each is part of
};

}  // namespace

Result<PlaneMap> find_planes(std::span<const float> depth, std::span<const float> normals,
                             const scene::Camera& camera, const PlaneRules& rules) {
    const std::size_t pixels = std::size_t{camera.height} * camera.width;
    SPLAT_TRY(check_map(depth, pixels, "the depth"));
    SPLAT_TRY(check_map(normals, 3 * pixels, "the normals"));
    const struct {
        const char* name;
        double value, most;
    } ranges[] = {{"angle", rules.degrees, 90}, {"offset", rules.offset, 1}};
    for (const auto& range : ranges)
        if (!(range.value > 0 && range.value <= range.most))
            return invalid(
                "the most %s of a plane's pixels is %g, expected more than 0 and at most %g",
                range.name, range.value, range.most);
    if (!(rules.least >= kLeastPlaneShare && rules.least <= 1))
        return invalid("the share of the smallest plane is %g, expected %g to 1", rules.least,
                       kLeastPlaneShare);
    return Finder(depth, normals, camera, rules).find();
}

}  // namespace splat::prior_scores
