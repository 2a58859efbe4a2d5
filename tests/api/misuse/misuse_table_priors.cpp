// The rows of scores of priors, and of points.
#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr const char* kNoMesh = "/nonexistent/mesh.obj";
constexpr std::uint32_t kMapSide = 41;  ///< the least that VIF takes
float g_map[std::size_t{3} * kMapSide * kMapSide] = {0.5F};
float g_broken_map[std::size_t{3} * kMapSide * kMapSide] = {__builtin_nanf("")};
const float kMisusePoints[6] = {};

splat_image map_image(std::uint32_t channels, std::uint32_t width = kMapSide) {
    splat_image image{};
    image.pixels = g_map;
    image.type = SPLAT_PIXEL_F32;
    image.width = width;
    image.height = kMapSide;
    image.channels = channels;
    return image;
}

using Compare = std::function<splat_result(const splat_image*, const splat_image*)>;

}  // namespace

void MisuseTable::prior_score_rows() {
    /// Wrong images of the first two parameters.
    const auto images = [this](const char* function, const char* second, std::uint32_t channels,
                               const Compare& compare) {
        const splat_image good = map_image(channels);
        splat_image no_type = good, broken = good;
        no_type.type = 0;
        broken.pixels = g_broken_map;
        for (const splat_image& wrong : {no_type, broken}) {
            add(function, "prediction", "no type, or not finite", kArgument,
                [=] { return compare(&wrong, &good); });
            add(function, second, "no type, or not finite", kArgument,
                [=] { return compare(&good, &wrong); });
        }
        add(function, "prediction", "NULL", kArgument, [=] { return compare(nullptr, &good); });
        add(function, second, "NULL", kArgument, [=] { return compare(&good, nullptr); });
        for (const splat_image& other : {map_image(channels, 40), map_image(2)}) {
            add(function, "prediction", "another size", SPLAT_ERROR_SHAPE_MISMATCH,
                [=] { return compare(&other, &good); });
            add(function, second, "another size", SPLAT_ERROR_SHAPE_MISMATCH,
                [=] { return compare(&good, &other); });
        }
    };
    const splat_image map = map_image(1), vectors = map_image(3), small = map_image(1, 40);
    images("splat_prior_compare_depth", "truth", 1, [this](const auto* a, const auto* b) {
        return splat_prior_compare_depth(a, b, nullptr, 0, out<splat_depth_scores>());
    });
    images("splat_prior_compare_normals", "truth", 3, [this](const auto* a, const auto* b) {
        return splat_prior_compare_normals(a, b, nullptr, 0, out<splat_normal_scores>());
    });
    images("splat_prior_compare_masks", "alpha", 1, [this](const auto* a, const auto* b) {
        return splat_prior_compare_masks(a, b, 0, out<splat_mask_scores>());
    });
    images("splat_prior_compare_images", "truth", 3, [this](const auto* a, const auto* b) {
        return splat_prior_compare_images(a, b, 0, out<splat_fidelity_scores>());
    });
    add("splat_prior_compare_images", "truth", "below 41 pixels", SPLAT_ERROR_SHAPE_MISMATCH,
        [=, this] {
            return splat_prior_compare_images(&small, &small, 0, out<splat_fidelity_scores>());
        });
    add("splat_prior_compare_depth", "mask", "another size", SPLAT_ERROR_SHAPE_MISMATCH, [=, this] {
        return splat_prior_compare_depth(&map, &map, &small, 0, out<splat_depth_scores>());
    });
    add("splat_prior_compare_depth", "mask", "where every pixel counts", kArgument, [=, this] {
        return splat_prior_compare_depth(&map, &map, &map, SPLAT_DEPTH_AS_PUBLISHED,
                                         out<splat_depth_scores>());
    });
    add("splat_prior_compare_normals", "mask", "another size", SPLAT_ERROR_SHAPE_MISMATCH,
        [=, this] {
            return splat_prior_compare_normals(&vectors, &vectors, &small, 0,
                                               out<splat_normal_scores>());
        });
}

void MisuseTable::prior_flag_rows() {
    const splat_image map = map_image(1), vectors = map_image(3);
    for (const std::uint32_t flags : {4U, UINT32_MAX}) {
        add("splat_prior_compare_depth", "flags", "unknown", kArgument, [=, this] {
            return splat_prior_compare_depth(&map, &map, nullptr, flags, out<splat_depth_scores>());
        });
        add("splat_prior_compare_normals", "flags", "unknown", kArgument, [=, this] {
            return splat_prior_compare_normals(&vectors, &vectors, nullptr, flags,
                                               out<splat_normal_scores>());
        });
        add("splat_prior_compare_masks", "flags", "unknown", kArgument, [=, this] {
            return splat_prior_compare_masks(&map, &map, flags, out<splat_mask_scores>());
        });
        add("splat_prior_compare_images", "flags", "unknown", kArgument, [=, this] {
            return splat_prior_compare_images(&map, &map, flags, out<splat_fidelity_scores>());
        });
    }
}

void MisuseTable::prior_filter_rows() {
    const splat_image good = map_image(1), other = map_image(1, 40), vectors = map_image(3);
    splat_image broken = good, one_place = good;
    broken.pixels = g_broken_map;
    one_place.pixel_stride = 4;
    const auto filter = [](const splat_image* map, splat_map_filter kind, const splat_image* out) {
        splat_image filled = out == nullptr ? splat_image{} : *out;
        return splat_prior_filter(map, kind, out == nullptr ? nullptr : &filled);
    };
    for (splat_map_filter kind = SPLAT_MAP_FILTER_CANNY; kind <= SPLAT_MAP_FILTER_OPENING; ++kind)
        add("splat_prior_filter", "map", "not finite", kArgument,
            [=] { return filter(&broken, kind, &good); });
    add("splat_prior_filter", "map", "of three channels", SPLAT_ERROR_SHAPE_MISMATCH,
        [=] { return filter(&vectors, SPLAT_MAP_FILTER_SOBEL, &good); });
    add("splat_prior_filter", "filtered", "another size", SPLAT_ERROR_SHAPE_MISMATCH,
        [=] { return filter(&good, SPLAT_MAP_FILTER_SOBEL, &other); });
    add("splat_prior_filter", "filtered", "two samples in one place", kArgument,
        [=] { return filter(&good, SPLAT_MAP_FILTER_SOBEL, &one_place); });
    for (const splat_map_filter kind : std::initializer_list<splat_map_filter>{-1, 0, 7})
        add("splat_prior_filter", "filter", "unknown", kArgument,
            [=] { return filter(&good, kind, &good); });
}

void MisuseTable::point_rows() {
    add("splat_points_from_mesh", "path", "no file", kNotFound,
        [this] { return splat_points_from_mesh(kNoMesh, 0, values_out(), 3); });
    add("splat_points_from_mesh", "seed", "of no file", kNotFound,
        [this] { return splat_points_from_mesh(kNoMesh, UINT64_MAX, values_out(), 3); });
    for (const std::uint64_t count : {std::uint64_t{4}, UINT64_MAX - 1})
        add("splat_points_from_mesh", "count", "no multiple of 3", kArgument,
            [this, count] { return splat_points_from_mesh(kNoMesh, 0, values_out(), count); });
    const splat_image depth = map_image(1), other = map_image(1, 40);
    splat_image broken = depth;
    broken.pixels = g_broken_map;
    const splat_camera camera = sample_camera(kMapSide, kMapSide);
    splat_camera no_camera = camera;
    no_camera.fx = 0;
    const auto from_depth = [this](const splat_image* image, const splat_camera* of) {
        return splat_points_from_depth(image, of, values_out(), 16, nullptr);
    };
    add("splat_points_from_depth", "depth", "not finite", kArgument,
        [=] { return from_depth(&broken, &camera); });
    add("splat_points_from_depth", "depth", "another size", SPLAT_ERROR_SHAPE_MISMATCH,
        [=] { return from_depth(&other, &camera); });
    add("splat_points_from_depth", "camera", "without a focal length", kArgument,
        [=] { return from_depth(&depth, &no_camera); });
    add("splat_points_from_depth", "points", "NULL with a capacity", SPLAT_INCOMPLETE,
        [=] { return splat_points_from_depth(&depth, &camera, nullptr, 16, nullptr); });
    add("splat_points_from_depth", "capacity", "too small", SPLAT_INCOMPLETE,
        [=, this] { return splat_points_from_depth(&depth, &camera, values_out(), 2, nullptr); });
    add("splat_points_from_depth", "needed", "NULL", SPLAT_INCOMPLETE,
        [=] { return splat_points_from_depth(&depth, &camera, nullptr, 0, nullptr); });
}

void MisuseTable::scene_point_rows() {
    const auto compare = [this](double opacity, const float* points, std::uint64_t count,
                                double threshold) {
        return splat_scene_compare_points(scene_, opacity, points, count, threshold,
                                          out<splat_point_scores>());
    };
    for (const double wrong : {-0.5, 1.5, __builtin_nan(""), __builtin_inf()})
        add("splat_scene_compare_points", "min_opacity", "out of range", kArgument,
            [=] { return compare(wrong, kMisusePoints, 6, 1); });
    add("splat_scene_compare_points", "min_opacity", "that no Gaussian has", kArgument,
        [=] { return compare(1, kMisusePoints, 6, 1); });
    add("splat_scene_compare_points", "points", "not finite", kArgument,
        [=] { return compare(0, g_broken_map, 3, 1); });
    for (const std::uint64_t count : {0U, 1U, 5U})
        add("splat_scene_compare_points", "count", "0, or no multiple of 3", kArgument,
            [=] { return compare(0, kMisusePoints, count, 1); });
    for (const double wrong : {0.0, -1.0, __builtin_nan(""), __builtin_inf()})
        add("splat_scene_compare_points", "threshold", "out of range", kArgument,
            [=] { return compare(0, kMisusePoints, 6, wrong); });
}

}  // namespace splat::test
