#include "raster/pack_camera.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/checked_math.h"
#include "params/project_params.h"
#include "raster/project.h"
#include "raster_constants.h"
#include "scene/camera_pose.h"

namespace splat::raster {
namespace {

using Matrix = std::array<double, 9>;

/// A smaller determinant means that the camera maps space onto a plane. Rotations have about 1.
constexpr double kLeastDeterminant = 1e-9;

double determinant(const Matrix& m) {
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
           m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/// -R^-1 t by Cramer's rule.
std::array<double, 3> position(const Matrix& r, const std::array<double, 3>& t, double det) {
    std::array<double, 3> p{};
    for (std::size_t column = 0; column < 3; ++column) {
        Matrix with_t = r;
        for (std::size_t row = 0; row < 3; ++row) with_t[3 * row + column] = -t[row];
        p[column] = determinant(with_t) / det;
    }
    return p;
}

/// Bounds of x/z (or y/z) in the Jacobian; see shaders/include/raster_constants.h.
std::array<double, 2> limits(double size, double focal, double centre, Convention convention) {
    const double half_field = size / (2 * focal);
    if (convention == Convention::k3dgs)
        return {-static_cast<double>(kFovMargin3dgs) * half_field,
                static_cast<double>(kFovMargin3dgs) * half_field};
    const double margin = static_cast<double>(kFovMarginGsplat) * half_field;
    return {-(centre / focal + margin), (size - centre) / focal + margin};
}

/// Errors: kInvalidArgument for a camera that is singular, mirrors, is not finite or has a lens out of range.
Result<std::array<float, 4 * kCameraQuads>> pack_camera(const scene::Camera& camera,
                                                        Convention convention) {
    const auto& m = camera.world_to_camera;
    const char* name = camera.name.empty() ? "?" : camera.name.c_str();
    const bool finite = std::all_of(m.begin(), m.end(), [](double x) { return std::isfinite(x); });
    if (!finite || !std::isfinite(camera.cx) || !std::isfinite(camera.cy) ||
        !std::isfinite(camera.fx) || !std::isfinite(camera.fy))
        return invalid("camera %s: a pose or intrinsic is not finite", name);
    if (const Status lens = scene::check_lens(camera.fx, camera.fy, camera.cx, camera.cy);
        !lens.ok())
        return invalid("camera %s: %s", name, lens.message().c_str());
    if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
        return invalid(
            "camera %s: the last row of world_to_camera is %g %g %g %g, expected 0 0 0 1; is the "
            "matrix column-major?",
            name, m[12], m[13], m[14], m[15]);
    const Matrix r = {m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]};
    const std::array<double, 3> t = {m[3], m[7], m[11]};
    const double det = determinant(r);
    if (!(std::abs(det) > kLeastDeterminant))
        return invalid("camera %s: its rotation is singular (determinant %g), expected about 1",
                       name, det);
    if (det < 0)
        return invalid(
            "camera %s: its rotation mirrors (determinant %g), expected about 1; check its axes",
            name, det);
    const auto p = position(r, t, det);
    const auto lx = limits(camera.width, camera.fx, camera.cx, convention);
    const auto ly = limits(camera.height, camera.fy, camera.cy, convention);
    const std::array<double, 4 * kCameraQuads> values = {
        r[0],      r[1],      r[2],      t[0],       //
        r[3],      r[4],      r[5],      t[1],       //
        r[6],      r[7],      r[8],      t[2],       //
        camera.fx, camera.fy, camera.cx, camera.cy,  //
        lx[0],     lx[1],     ly[0],     ly[1],      //
        p[0],      p[1],      p[2],      0};
    std::array<float, 4 * kCameraQuads> packed{};
    std::transform(values.begin(), values.end(), packed.begin(),
                   [](double x) { return static_cast<float>(x); });
    const bool fits =
        std::all_of(packed.begin(), packed.end(), [](float x) { return std::isfinite(x); });
    if (!fits)
        return invalid(
            "camera %s: its pose, its position (%g %g %g) or a bound of its view exceeds "
            "float32; move the scene closer to the origin",
            name, p[0], p[1], p[2]);
    return packed;
}

/// A range of a call, once.
struct SeenRange {
    Range range;
    std::uint32_t layer;
    std::size_t last;  ///< view that sees it
};

/// True if both hold a Gaussian.
bool overlap(const Range& a, const Range& b) {
    return std::max(a.first, b.first) <
           std::min(std::uint64_t{a.first} + a.count, std::uint64_t{b.first} + b.count);
}

/// Layer of a range that comes after those `seen`: behind all that it overlaps.
std::uint32_t layer_of(const Range& range, const std::vector<SeenRange>& seen) {
    std::uint32_t layer = 0;
    for (const SeenRange& before : seen)
        if (overlap(range, before.range)) layer = std::max(layer, before.layer + 1);
    return layer;
}

/// Link the views that see the same range, and give each range its layer. Those of a layer are disjoint, so their sizes
/// tell whether the first holds all Gaussians.
void link_views(std::span<const Range> ranges, std::uint32_t gaussians, PackedViews& views) {
    std::vector<SeenRange> seen;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> places;
    std::uint64_t covered = 0;
    for (std::size_t v = 0; v < ranges.size(); ++v) {
        const auto [at, fresh] =
            places.try_emplace({ranges[v].first, ranges[v].count}, seen.size());
        std::uint32_t* row = &views.view_ranges[v * params::kRangeWords];
        row[params::kRangeNext] = static_cast<std::uint32_t>(ranges.size());
        row[params::kRangeLayer] = ~0U;
        if (!fresh) {
            SeenRange& same = seen[at->second];
            views.view_ranges[same.last * params::kRangeWords + params::kRangeNext] =
                static_cast<std::uint32_t>(v);
            same.last = v;
            continue;
        }
        const std::uint32_t layer = layer_of(ranges[v], seen);
        row[params::kRangeLayer] = layer;
        views.ranges.layers = std::max(views.ranges.layers, layer + 1);
        if (layer == 0) covered += ranges[v].count;
        seen.push_back({ranges[v], layer, v});
    }
    views.ranges.covers = covered == gaussians;
}

}  // namespace

Result<PackedViews> pack_views(const RasterDesc& desc, std::span<const scene::Camera> cameras,
                               const std::array<float, 3>& background) {
    if (cameras.size() > desc.views)
        return invalid("rasterizer: %zu cameras, expected at most %u", cameras.size(), desc.views);
    PackedViews views;
    views.background = {background[0], background[1], background[2], 0};
    for (const scene::Camera& camera : cameras) {
        if (camera.width < 1 || camera.height < 1 || camera.width > desc.width ||
            camera.height > desc.height)
            return invalid(
                "camera %s: %u x %u pixels, but the rasterizer was made for at most %u x %u",
                camera.name.c_str(), camera.width, camera.height, desc.width, desc.height);
        SPLAT_ASSIGN(const auto packed, pack_camera(camera, desc.convention));
        views.cameras.insert(views.cameras.end(), packed.begin(), packed.end());
        views.background.insert(views.background.end(), {static_cast<float>(camera.width),
                                                         static_cast<float>(camera.height), 0, 0});
        views.smaller = views.smaller || camera.width < desc.width || camera.height < desc.height;
    }
    return views;
}

Status mask_tiles(const RasterDesc& desc, std::span<const std::uint8_t> active,
                  PackedViews& views) {
    const std::size_t row = desc.tiles_x();
    const std::size_t words = (row + 31) / 32;
    const std::size_t rows = std::size_t{desc.tiles_y()} * views.count();
    if (active.size() != rows * row)
        return invalid("rasterizer: a mask of %zu tiles, expected %zu (%u views of %u x %u)",
                       active.size(), rows * row, views.count(), desc.tiles_x(), desc.tiles_y());
    views.active_tiles.assign(rows * words, 0);
    for (std::size_t i = 0; i < active.size(); ++i)
        if (active[i] != 0)
            views.active_tiles[i / row * words + i % row / 32] |= 1U << (i % row % 32);
    return {};
}

Status see_ranges(const vk::DeviceInfo& device, const RasterDesc& desc, std::uint32_t gaussians,
                  std::span<const Range> ranges, PackedViews& views) {
    if (ranges.size() != views.count())
        return invalid("rasterizer: ranges of %zu views, expected %u", ranges.size(),
                       views.count());
    const std::uint32_t size = projection_group(device);
    PackedViews made = views;
    made.view_ranges.assign(ranges.size() * params::kRangeWords, 0);
    made.ranges = {.used = !ranges.empty()};
    made.items = 0;
    for (std::size_t v = 0; v < ranges.size(); ++v) {
        const auto [first, count] = ranges[v];
        const std::uint64_t end = std::uint64_t{first} + count;
        if (end > gaussians)
            return invalid("rasterizer: view %zu sees Gaussians %u to %llu, but there are %u", v,
                           first, llu(end), gaussians);
        std::uint32_t* row = &made.view_ranges[v * params::kRangeWords];
        row[params::kRangeFirst] = first;
        row[params::kRangeCount] = count;
        row[params::kRangeItems] = static_cast<std::uint32_t>(made.items);
        row[params::kRangeGroups] = made.ranges.groups;
        const std::int64_t shift = std::int64_t{first} - static_cast<std::int64_t>(made.items);
        made.background[4 * (v + 1) + 2] = static_cast<float>(shift >> 12);
        made.background[4 * (v + 1) + 3] = static_cast<float>(shift & 4095);
        made.items += count;
        made.ranges.groups +=
            static_cast<std::uint32_t>(ceil_div(std::uint64_t{count}, std::uint64_t{size}));
        made.ranges.end = std::max(made.ranges.end, static_cast<std::uint32_t>(end));
        if (made.items > desc.items())
            return invalid(
                "rasterizer: the ranges of views 0 to %zu hold %llu Gaussians, but it was made for "
                "%llu",
                v, llu(made.items), llu(desc.items()));
    }
    link_views(ranges, gaussians, made);
    views = std::move(made);
    return {};
}

Status check_items(const RasterDesc& desc, std::uint32_t gaussians, const PackedViews& views) {
    const std::uint64_t items =
        views.ranges.used ? views.items : std::uint64_t{gaussians} * views.count();
    if (items <= desc.items()) return {};
    return invalid(
        "rasterizer: %u Gaussians in %u views, but it was made for at most %llu items (a Gaussian "
        "in a view)",
        gaussians, views.count(), llu(desc.items()));
}

}  // namespace splat::raster
