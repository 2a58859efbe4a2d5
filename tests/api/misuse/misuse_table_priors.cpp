// The rows of maps, their scores and models of priors, and of points.
#include <cmath>
#include <cstdint>
#include <fstream>
#include <string>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

const float kMisusePoints[6] = {};

/// One number is not finite.
std::vector<float> g_broken = [] {
    std::vector<float> values(std::size_t{3} * 48 * 48, 0.5F);
    values[0] = NAN;
    return values;
}();
std::vector<float> g_broken_planes = [] {
    std::vector<float> values(std::size_t{4} * 48 * 48, 1);
    values[0] = NAN;
    return values;
}();
std::vector<float> g_twos(std::size_t{48} * 48, 2);

/// Named like weights; what it holds is not read before the device is found.
const std::string g_weights = [] {
    std::string path = testing::TempDir() + "misuse_weights.pt";
    std::ofstream(path) << "weights";
    return path;
}();

template <class Change>
splat_image changed(splat_image image, Change&& change) {
    change(image);
    return image;
}

splat_image broken(const splat_image& map) {
    return changed(map, [](auto& i) { i.pixels = g_broken.data(); });
}
splat_image of_width(const splat_image& map, std::uint32_t width) {
    return changed(map, [width](auto& i) { i.width = width; });
}
splat_image of_channels(const splat_image& map, std::uint32_t channels) {
    return changed(map, [channels](auto& i) { i.channels = channels; });
}
splat_image of_type(const splat_image& map, splat_pixel type) {
    return changed(map, [type](auto& i) { i.type = type; });
}

}  // namespace

void MisuseTable::prior_score_rows() {
    const splat_image map = good<splat_prior_maps>().mask, vectors = good<splat_image>();
    const splat_image narrow = of_width(map, 40);
    /// Wrong images of the first two parameters.
    const auto images = [](const auto& rows, const char* second, const splat_image& image) {
        for (const char* parameter : {"prediction", second})
            rows.each(parameter, "no type, or not finite", kArgument, of_type(image, 0),
                      broken(image))
                .each(parameter, "NULL", kArgument, nullptr)
                .each(parameter, "another size", kShape, of_width(image, 40),
                      of_channels(image, 2));
        rows.each("flags", "unknown", kArgument, 4U, UINT32_MAX);
    };
    const auto depth = SPLAT_WRONG(splat_prior_compare_depth);
    images(depth, "truth", map);
    images(SPLAT_WRONG(splat_prior_compare_normals), "truth", vectors);
    const splat_image plane = {
        g_broken_planes.data(), 0, SPLAT_PIXEL_F32, 48, 48, 4, 0, 0, 0};
    const auto compare_planes = SPLAT_WRONG(splat_prior_compare_planes);
    for (const char* parameter : {"prediction", "truth"})
        compare_planes.each(parameter, "of three channels", kShape, vectors)
            .each(parameter, "another size", kShape, of_width(plane, 40))
            .each(parameter, "not finite", kArgument, plane)
            .each(parameter, "NULL", kArgument, nullptr);
    compare_planes.each("flags", "unknown", kArgument, 4U, UINT32_MAX)
        .each("max_distance", "out of range", kArgument, -1, NAN)
        .each("max_degrees", "out of range", kArgument, -1, 181, NAN);
    images(SPLAT_WRONG(splat_prior_compare_masks), "alpha", map);
    images(SPLAT_WRONG(splat_prior_compare_images), "truth", vectors);
    SPLAT_WRONG(splat_prior_compare_images)
        .given("prediction", narrow)
        .each("truth", "below 41 pixels", kShape, narrow);
    depth.each("mask", "another size", kShape, narrow)
        .given("flags", SPLAT_DEPTH_AS_PUBLISHED)
        .each("mask", "where every pixel counts", kArgument, map);
    SPLAT_WRONG(splat_prior_compare_normals).each("mask", "another size", kShape, narrow);
    const auto filter = SPLAT_WRONG(splat_prior_filter);
    for (splat_map_filter kind = SPLAT_MAP_FILTER_CANNY; kind <= SPLAT_MAP_FILTER_OPENING; ++kind)
        filter.given("filter", kind).each("map", "not finite", kArgument, broken(map));
    filter.each("map", "of three channels", kShape, vectors)
        .each("filtered", "another size", kShape, narrow)
        .each("filtered", "two samples in one place", kArgument,
              changed(map, [](auto& i) { i.pixel_stride = 4; }))
        .each("filter", "unknown", kArgument, -1, 0, 7);
}

void MisuseTable::point_rows() {
    const auto mesh = SPLAT_WRONG(splat_points_from_mesh);
    mesh.as_is("path", "no file", kNotFound)
        .each("seed", "of no file", kNotFound, UINT64_MAX)
        .each("count", "no multiple of 3", kArgument, 4, UINT64_MAX - 1);
    const splat_image map = good<splat_prior_maps>().mask;
    splat_camera no_camera = sample_camera(48, 48);
    const auto from_depth = SPLAT_WRONG(splat_points_from_depth).given("camera", no_camera);
    no_camera.fx = 0;
    from_depth.each("depth", "not finite", kArgument, broken(map))
        .each("depth", "another size", kShape, of_width(map, 40))
        .each("camera", "without a focal length", kArgument, no_camera)
        .each("points", "NULL with a capacity", SPLAT_INCOMPLETE, nullptr)
        .each("capacity", "too small", SPLAT_INCOMPLETE, 2)
        .given("points", nullptr)
        .given("capacity", 0)
        .as_is("needed", "NULL", SPLAT_INCOMPLETE);
    SPLAT_WRONG(splat_scene_compare_points)
        .given("points", kMisusePoints)
        .given("count", 6)
        .each("min_opacity", "out of range", kArgument, -0.5, 1.5, NAN, INFINITY)
        .each("min_opacity", "that no Gaussian has", kArgument, 1)
        .each("count", "0, or no multiple of 3", kArgument, 0, 1, 5)
        .each("threshold", "out of range", kArgument, 0, -1, NAN, INFINITY)
        .given("count", 3)
        .each("points", "not finite", kArgument, g_broken.data());
}

void MisuseTable::prior_model_rows() {
    const auto preset = SPLAT_WRONG(splat_prior_preset);
    preset.each("name", "no preset", kNotFound, "none")
        .given("buffer", nullptr)
        .given("capacity", 0)
        .given("needed", nullptr)
        .each("name", "NULL: the names", SPLAT_INCOMPLETE, nullptr);
    const splat_image map = good<splat_prior_maps>().mask, vectors = good<splat_image>();
    const auto mask = SPLAT_WRONG(splat_picture_mask);
    for (const char* parameter : {"picture", "mask"})
        mask.each(parameter, "NULL", kArgument, nullptr)
            .each(parameter, "a type of pixels that is unknown", kArgument,
                  of_type(parameter[0] == 'p' ? vectors : map, 9));
    static std::uint8_t bytes[48 * 48];
    mask.each("mask", "three channels", kShape, vectors)
        .given("mask", splat_image{bytes, sizeof bytes, SPLAT_PIXEL_U8, 48, 48, 1, 0, 0, 0})
        .as_is("found", "NULL: not wanted", SPLAT_OK);
    const auto desc = wrong_structs<splat_normals_desc>("splat_normals_from_depth");
    desc("no focal length", kArgument, [](auto& d) { d.focal_x = 0; });
    desc("a focal length that is no number", kArgument, [](auto& d) { d.focal_y = NAN; });
    desc("a centre that is no number", kArgument, [](auto& d) { d.center_x = NAN; });
    desc("farthest before nearest", kArgument, [](auto& d) { d.nearest = 2, d.farthest = 1; });
    desc("only farthest", kArgument, [](auto& d) { d.farthest = 1; });
    splat_normals_desc relative = good<splat_normals_desc>();
    relative.nearest = 1, relative.farthest = 2;
    SPLAT_WRONG(splat_normals_from_depth)
        .each("depth", "three channels", kShape, vectors)
        .each("normal", "one channel", kShape, map)
        .given("desc", relative)
        .each("depth", "relative depth above 1", kArgument,
              changed(map, [](auto& i) { i.pixels = g_twos.data(); }));
    const auto rules = wrong_structs<splat_planes_desc>("splat_planes_from_depth");
    rules("an angle above 90", kArgument, [](auto& d) { d.max_degrees = 91; });
    rules("an offset below 0", kArgument, [](auto& d) { d.max_offset = -0.1; });
    rules("too small planes", kArgument, [](auto& d) { d.least_share = 1e-4; });
    rules("no number", kArgument, [](auto& d) { d.least_share = NAN; });
    rules("vectors in F32", SPLAT_OK, [](auto& d) { d.flags = SPLAT_NORMAL_VECTORS; });
    SPLAT_WRONG(splat_planes_from_depth)
        .each("depth", "three channels", kShape, vectors)
        .each("normal", "one channel", kShape, map)
        .each("normal", "not finite", kArgument, broken(vectors))
        .each("plane", "three channels", kShape, vectors)
        .as_is("desc", "NULL: the defaults", SPLAT_OK)
        .as_is("count", "NULL: not asked for", SPLAT_OK)
        .given("camera", relative)
        .each("depth", "relative depth above 1", kArgument,
              changed(map, [](auto& i) { i.pixels = g_twos.data(); }));
    const auto invalid = wrong_structs<splat_prior_model_desc>("splat_prior_model_create");
    invalid("no runtime", kNotFound, [](auto&) {});
    invalid("no preset of this name", kNotFound, [](auto& d) { d.preset = "none"; });
    invalid("no preset for this file", kNotFound,
            [](auto& d) { d.preset = nullptr, d.model_path = "net.onnx"; });
    invalid("neither preset nor model", kArgument,
            [](auto& d) { d.preset = d.model_path = nullptr; });
    invalid("JSON without members", kArgument, [](auto& d) { d.preset = "{}"; });
    invalid("JSON that ends early", kArgument, [](auto& d) { d.preset = "{"; });
    invalid("too many threads", kArgument, [](auto& d) { d.threads = UINT32_MAX; });
    invalid("tokens for a network without them", kArgument, [](auto& d) { d.tokens = 1200; });
    invalid("weights without a device", kArgument,
            [](auto& d) { d.preset = "moge-2-vits-normal", d.model_path = g_weights.c_str(); });
    invalid("a device that does not exist", kHandle, [](auto& d) {
        d.preset = "moge-2-vits-normal", d.model_path = g_weights.c_str();
        d.device = reinterpret_cast<splat_device>(std::uintptr_t{0x7777777});
    });
    SPLAT_WRONG(splat_prior_model_run).each("count", "0", kArgument, 0U);
    SPLAT_WRONG(splat_prior_model_run_focal).each("count", "0", kArgument, 0U);
}

}  // namespace splat::test
