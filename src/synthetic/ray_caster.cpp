#include "synthetic/ray_caster.h"

#include <algorithm>
#include <limits>

#include "scene/camera_pose.h"

namespace splat::synthetic {
namespace {

constexpr double kAmbient = 0.45;
constexpr double kDiffuse = 0.55;
/// Towards the light: above, from the front left; of length 1.
constexpr Vec3 kLight = {0.48, 0.36, 0.8};
constexpr int kRaysPerSide = 4;
constexpr std::uint32_t kNothing = 0;

/// Columns and rows that a solid may cover, both ends included.
struct Window {
    int left = 0, right = 0, top = 0, bottom = 0;

    [[nodiscard]] bool holds(int x, int y) const {
        return x >= left && x <= right && y >= top && y <= bottom;
    }
};

class Caster {
  public:
    Caster(const Solids& solids, const scene::Camera& camera)
        : solids_(solids),
          camera_(camera),
          eye_(scene::camera_center(camera)),
          rotation_(scene::rotation_of(camera.world_to_camera)) {
        for (const Solid& solid : solids) windows_.push_back(window_of(solid));
        const std::size_t pixels = std::size_t{camera.width} * camera.height;
        nearest_.resize(pixels);
        faces_.assign(pixels, kNothing);
    }

    Picture picture() {
        cast_centers();
        const std::uint32_t width = camera_.width;
        const std::uint32_t height = camera_.height;
        const std::size_t pixels = nearest_.size();
        Picture out{width, height, {}, std::vector<float>(pixels), std::vector<float>(pixels * 3)};
        out.rgb.assign(pixels * 3, 1.0F);
        for (std::uint32_t y = 0; y < height; ++y)
            for (std::uint32_t x = 0; x < width; ++x)
                fill(static_cast<int>(x), static_cast<int>(y), out);
        return out;
    }

  private:
    [[nodiscard]] std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * camera_.width + static_cast<std::size_t>(x);
    }

    /// Distances along it are depths.
    [[nodiscard]] Ray ray_at(double x, double y) const {
        const Vec3 seen = {(x - camera_.cx) / camera_.fx, (y - camera_.cy) / camera_.fy, 1};
        return {eye_, seen * rotation_};
    }

    /// The window of a solid; the whole image if it reaches behind the camera.
    [[nodiscard]] Window window_of(const Solid& solid) const {
        const Window all = {0, last_column(), 0, last_row()};
        double low[] = {1e9, 1e9};
        double high[] = {-1e9, -1e9};
        for (const Vec3& point : solid.hull) {
            const Vec3 c = rotation_ * (point - eye_);
            if (c[2] < 1e-3) return all;
            const double at[] = {camera_.cx + camera_.fx * c[0] / c[2],
                                 camera_.cy + camera_.fy * c[1] / c[2]};
            for (const std::size_t i : {0U, 1U}) {
                low[i] = std::min(low[i], at[i]);
                high[i] = std::max(high[i], at[i]);
            }
        }
        const auto pixel = [](double v, int most) {
            return static_cast<int>(std::clamp(std::floor(v), -1.0, most + 1.0));
        };
        return {pixel(low[0] - 1e-6, last_column()), pixel(high[0] + 1e-6, last_column()),
                pixel(low[1] - 1e-6, last_row()), pixel(high[1] + 1e-6, last_row())};
    }

    void cast_centers() {
        for (std::size_t i = 0; i < solids_.size(); ++i) {
            const Window& w = windows_[i];
            for (int y = std::max(0, w.top); y <= std::min(w.bottom, last_row()); ++y)
                for (int x = std::max(0, w.left); x <= std::min(w.right, last_column()); ++x) {
                    const auto hit = enter(solids_[i], ray_at(x + 0.5, y + 0.5));
                    Hit& nearest = nearest_[index(x, y)];
                    std::uint32_t& face = faces_[index(x, y)];
                    if (!hit || (face != kNothing && hit->distance >= nearest.distance)) continue;
                    nearest = *hit;
                    face = face_of(i, *hit);
                }
        }
    }

    static std::uint32_t face_of(std::size_t solid, const Hit& hit) {
        return static_cast<std::uint32_t>(solid + 1) * 256U + static_cast<std::uint32_t>(hit.face);
    }

    [[nodiscard]] int last_column() const { return static_cast<int>(camera_.width) - 1; }
    [[nodiscard]] int last_row() const { return static_cast<int>(camera_.height) - 1; }

    /// The pixels around show different faces.
    [[nodiscard]] bool on_edge(int x, int y) const {
        const std::uint32_t face = faces_[index(x, y)];
        for (int v = std::max(0, y - 1); v <= std::min(y + 1, last_row()); ++v)
            for (int u = std::max(0, x - 1); u <= std::min(x + 1, last_column()); ++u)
                if (faces_[index(u, v)] != face) return true;
        return false;
    }

    static Vec3 shade(const Solid& solid, const Vec3& normal) {
        const double light = kAmbient + kDiffuse * std::max(0.0, glm::dot(normal, kLight));
        return solid.color * light;
    }

    /// The colour along a ray that passes through a pixel.
    [[nodiscard]] Vec3 color_at(double x, double y, int column, int row) const {
        const Ray ray = ray_at(x, y);
        double nearest = std::numeric_limits<double>::infinity();
        Vec3 color = {1, 1, 1};
        for (std::size_t i = 0; i < solids_.size(); ++i) {
            if (!windows_[i].holds(column, row)) continue;
            const auto hit = enter(solids_[i], ray);
            if (!hit || hit->distance >= nearest) continue;
            nearest = hit->distance;
            color = shade(solids_[i], hit->normal);
        }
        return color;
    }

    [[nodiscard]] Vec3 mean_color(int x, int y) const {
        Vec3 sum{};
        for (int v = 0; v < kRaysPerSide; ++v)
            for (int u = 0; u < kRaysPerSide; ++u)
                sum += color_at(x + (u + 0.5) / kRaysPerSide, y + (v + 0.5) / kRaysPerSide, x, y);
        return sum * (1.0 / (kRaysPerSide * kRaysPerSide));
    }

    void fill(int x, int y, Picture& out) const {
        const std::size_t i = index(x, y);
        const std::uint32_t face = faces_[i];
        const Hit& hit = nearest_[i];
        Vec3 color = {1, 1, 1};
        if (face != kNothing) {
            color = shade(solids_[face / 256U - 1], hit.normal);
            out.depth[i] = static_cast<float>(hit.distance);
            const Vec3 normal = rotation_ * hit.normal;
            for (std::size_t k = 0; k < 3; ++k)
                out.normals[i * 3 + k] = static_cast<float>(normal[k]);
        }
        if (on_edge(x, y)) color = mean_color(x, y);
        for (std::size_t k = 0; k < 3; ++k) out.rgb[i * 3 + k] = static_cast<float>(color[k]);
    }

    const Solids& solids_;
    const scene::Camera& camera_;
    Vec3 eye_;
    Mat3 rotation_;
    std::vector<Window> windows_;
    std::vector<Hit> nearest_;          ///< through the pixels' centres
    std::vector<std::uint32_t> faces_;  ///< solid and face there, or kNothing
};

}  // namespace

Picture cast(const Solids& solids, const scene::Camera& camera) {
    return Caster(solids, camera).picture();
}

io::Image mask_image(const Picture& picture) {
    io::Image image{picture.width, picture.height, 1, 8, {}};
    for (const float depth : picture.depth) image.samples.push_back(depth > 0 ? 255 : 0);
    return image;
}

}  // namespace splat::synthetic
