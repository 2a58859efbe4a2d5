// The rows of cameras and rasterizers.
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr double kZero[16] = {};
constexpr double kEye[3] = {0, 0, -4};
constexpr double kUp[3] = {0, -1, 0};

}  // namespace

void MisuseTable::camera_rows() {
    const auto from_fov = SPLAT_WRONG(splat_camera_from_fov)
                              .given("width", 8U)
                              .given("height", 8U)
                              .given("fov_x", 0.7);
    from_fov.each("width", "out of range", kArgument, 0U, 16385U, UINT32_MAX)
        .each("height", "out of range", kArgument, 0U, 16385U, UINT32_MAX)
        .each("fov_x", "out of range", kArgument, -1.0, 0.0, 3.2, NAN);
    const auto look = SPLAT_WRONG(splat_camera_look_at)
                          .given("eye", kEye)
                          .given("target", kZero)
                          .given("up", kUp);
    for (const char* parameter : {"eye", "target", "up"})
        look.each(parameter, "NULL", kArgument, nullptr);
    look.each("target", "the eye", kArgument, kEye)
        .each("up", "along the view", kArgument, kEye)
        .each("up", "zero", kArgument, kZero);
    SPLAT_WRONG(splat_camera_from_opengl)
        .each("camera_to_world", "NULL", kArgument, nullptr)
        .each("camera_to_world", "zeros", kArgument, kZero);
    SPLAT_WRONG(splat_camera_orbit)
        .given("desc", nullptr)
        .each("count", "0: no cameras", SPLAT_OK, 0U)
        .each("cameras", "NULL", kArgument, nullptr);
    SPLAT_WRONG(splat_camera_path)
        .each("key_count", "0: no poses", kArgument, 0U)
        .each("closed", "out of range", kArgument, 2U, UINT32_MAX)
        .each("cameras", "NULL", kArgument, nullptr)
        .as_is("count", "of one pose", kArgument);
}

void MisuseTable::camera_file_rows() {
    const auto load = SPLAT_WRONG(splat_camera_load);
    for (const char* parameter : {"path", "capacity", "count"})
        load.as_is(parameter, "of a missing file", kNotFound);
    load.each("cameras", "NULL", kArgument, nullptr);
    for (const char* parameter : {"path", "buffer", "capacity", "needed"})
        SPLAT_WRONG(splat_camera_load_report).as_is(parameter, "of a missing file", kNotFound);
}

void MisuseTable::rasterizer_rows() {
    const auto invalid = wrong_structs<splat_rasterizer_desc>("splat_rasterizer_create");
    invalid("no width", kArgument, [](auto& d) { d.width = 0; });
    invalid("no height", kArgument, [](auto& d) { d.height = 0; });
    invalid("too wide", kUnsupported, [](auto& d) { d.width = UINT32_MAX; });
    invalid("too many with gradients", kUnsupported, [](auto& d) {
        d.gaussians = UINT32_MAX;
        d.flags = SPLAT_RASTERIZER_BACKWARD;
    });
    invalid("too many views", kUnsupported, [](auto& d) { d.views = UINT32_MAX; });
    invalid("a degree too high", kArgument, [](auto& d) { d.sh_degree = 4; });
    invalid("unknown skips", kArgument, [](auto& d) { d.disabled_skips = 64; });
    invalid("an unknown convention", kArgument, [](auto& d) { d.convention = 4; });
    invalid("a negative convention", kArgument, [](auto& d) { d.convention = -1; });
    invalid("a negative near plane", kArgument, [](auto& d) { d.near_plane = -1; });
    invalid("a near plane that is NaN", kArgument, [](auto& d) { d.near_plane = NAN; });
    invalid("far before near", kArgument, [](auto& d) { d.far_plane = 0.1F; });
    invalid("poses in 3dgs", kArgument, [](auto& d) { d.flags = SPLAT_RASTERIZER_GRAD_POSE; });
    invalid("intrinsics in 3dgs", kArgument,
            [](auto& d) { d.flags = SPLAT_RASTERIZER_GRAD_INTRINSICS; });
    invalid("the original gradient in gsplat", kArgument, [](auto& d) {
        d.flags = SPLAT_RASTERIZER_ORIGINAL_GRADIENT;
        d.convention = SPLAT_CONVENTION_GSPLAT;
    });
    invalid("gradients in ray_maximum", kArgument, [](auto& d) {
        d.flags = SPLAT_RASTERIZER_BACKWARD;
        d.convention = SPLAT_CONVENTION_RAY_MAXIMUM;
    });
    invalid("antialiased in ray_maximum", kArgument, [](auto& d) {
        d.flags = SPLAT_RASTERIZER_ANTIALIASED;
        d.convention = SPLAT_CONVENTION_RAY_MAXIMUM;
    });
    invalid("bands of direct colours", kArgument,
            [](auto& d) { d.flags = SPLAT_RASTERIZER_DIRECT_COLORS; });
}

void MisuseTable::forward_rows() {
    const auto both = [this](const auto& rows) {
        static constexpr float kBackground[3] = {0, INFINITY, 0};
        rows.each("cameras", "NULL", kArgument, nullptr)
            .each("count", "more than views", kArgument, 2U)
            .each("background", "not finite", kArgument, kBackground)
            .each("state", "of another rasterizer", kArgument, foreign_state_);
        const auto invalid = wrong_structs<splat_camera>(rows.function(), "cameras");
        invalid("too wide", kArgument, [](auto& c) { c.width = 17; });
        invalid("too high", kArgument, [](auto& c) { c.height = 17; });
        invalid("without pixels", kArgument, [](auto& c) { c.width = 0; });
        invalid("no focal length", kArgument, [](auto& c) { c.fx = 0; });
        invalid("a focal length below 0", kArgument, [](auto& c) { c.fy = -1; });
        invalid("a centre that is not finite", kArgument, [](auto& c) { c.cx = NAN; });
        invalid("a pose that is not finite", kArgument,
                [](auto& c) { c.world_to_camera[3] = INFINITY; });
        invalid("a singular pose", kArgument,
                [](auto& c) { std::fill_n(c.world_to_camera, 16, 0); });
    };
    const auto submit = SPLAT_WRONG(splat_rasterizer_submit);
    submit.each("camera", "of a device of the library", kState, sample_camera(16, 16))
        .each("state", "of another rasterizer", kArgument, foreign_state_);
    static constexpr float kNoColor[3] = {NAN, 0, 0};
    submit.each("background", "not finite", kArgument, kNoColor);
    const auto target = wrong_structs<splat_vulkan_target>(submit.function(), "target");
    target("neither image nor buffer", kArgument, [](auto& t) { t.buffer = 0; });
    target("an unknown format", kArgument, [](auto& t) { t.format = UINT32_MAX; });
    target("an odd offset", kArgument, [](auto& t) { t.offset = 1; });
    target("too few bytes", kArgument, [](auto& t) { t.bytes = 16 * 16 * 4 - 1; });
    both(SPLAT_WRONG(splat_rasterizer_forward_scene).given("state", nullptr));
    both(SPLAT_WRONG(splat_rasterizer_forward).given("state", nullptr));
    SPLAT_WRONG(splat_rasterizer_forward_scene)
        .given("rasterizer", drawn_)
        .given("state", nullptr)
        .each("count", "more than the device takes", kUnsupported, UINT32_MAX);
    auto without_means = sized<splat_gaussians_desc>();
    without_means.scales = tensor_;
    SPLAT_WRONG(splat_rasterizer_forward)
        .given("state", nullptr)
        .each("gaussians", "without means", kArgument, without_means);
    auto mask = sized<splat_gaussians_desc>();
    mask.active_tile_count = 2;
    SPLAT_WRONG(splat_rasterizer_forward)
        .given("state", nullptr)
        .each("gaussians", "tiles that are NULL", kArgument, mask);
    auto ranges = sized<splat_gaussians_desc>();
    ranges.view_range_count = 2;
    SPLAT_WRONG(splat_rasterizer_forward)
        .given("state", nullptr)
        .each("gaussians", "ranges that are NULL", kArgument, ranges);
}

void MisuseTable::raster_output_rows() {
    const auto states = [this](const auto& rows) {
        rows.each("state", "of another rasterizer", kArgument, foreign_state_);
    };
    const auto output = SPLAT_WRONG(splat_rasterizer_output).given("state", nullptr);
    const auto read = SPLAT_WRONG(splat_rasterizer_read).given("state", nullptr);
    const auto images = SPLAT_WRONG(splat_rasterizer_read_images);
    states(output);
    states(read);
    states(images);
    states(SPLAT_WRONG(splat_rasterizer_backward));
    states(SPLAT_WRONG(splat_rasterizer_get_info));
    output.each("output", "none", kArgument, INT32_MIN, -1, 0, 14, INT32_MAX)
        .given("rasterizer", drawn_)
        .given("output", SPLAT_OUTPUT_RGB)
        .as_is("tensor", "of another shape", kShape);
    read.each("output", "none", kArgument, INT32_MIN, -1, 0, 14, INT32_MAX)
        .each("bytes", "too few", kArgument, 11)
        .given("rasterizer", rasterizer_)
        .as_is("rasterizer", "before a forward call", kState);
    SPLAT_WRONG(splat_rasterizer_backward)
        .given("state", nullptr)
        .as_is("gradients", "before a forward call", kState);
    images.each("output", "no image", kArgument, INT32_MIN, 0, 14, INT32_MAX, SPLAT_OUTPUT_RADII);
    for (const char* parameter : {"first", "count"}) {
        images.given("rasterizer", rasterizer_).as_is(parameter, "before a forward call", kState);
        images.given("first", UINT32_MAX).as_is(parameter, "beyond the views", kArgument);
    }
    const auto invalid = wrong_structs<splat_image>("splat_rasterizer_read_images", "images");
    invalid("without pixels", kArgument, [](auto& i) { i.pixels = nullptr; });
    invalid("of no type", kArgument, [](auto& i) { i.type = 4; });
    invalid("too short", kArgument, [](auto& i) { i.bytes -= 1; });
    invalid("that overlap", kArgument, [](auto& i) { i.row_stride = 60; });
    invalid("too narrow", kShape, [](auto& i) { i.width = 15; });
    invalid("of two channels", kShape, [](auto& i) { i.channels = 2; });
}

void MisuseTable::scene_render_rows() {
    const auto render = SPLAT_WRONG(splat_scene_render);
    render.each("cameras", "NULL", kArgument, nullptr)
        .each("images", "NULL", kArgument, nullptr)
        .given("cameras", nullptr)
        .given("images", nullptr)
        .each("count", "0: no views", SPLAT_OK, 0U);
    const auto desc = wrong_structs<splat_scene_render_desc>("splat_scene_render");
    desc("an output of Gaussians", kArgument, [](auto& d) { d.output = SPLAT_OUTPUT_RADII; });
    desc("no output", kArgument, [](auto& d) { d.output = 14; });
    desc("an unknown convention", kArgument, [](auto& d) { d.convention = 4; });
    desc("gradients", kArgument, [](auto& d) { d.flags = SPLAT_RASTERIZER_BACKWARD; });
    desc("as given twice", kArgument, [](auto& d) { d.as_given = 2; });
    desc("a background that is not finite", kArgument, [](auto& d) { d.background[2] = NAN; });
    const auto cameras = wrong_structs<splat_camera>("splat_scene_render", "cameras");
    cameras("without pixels", kArgument, [](auto& c) { c.width = 0; });
    cameras("too wide", kUnsupported, [](auto& c) { c.width = UINT32_MAX; });
    wrong_structs<splat_image>("splat_scene_render", "images")("of another size", kShape,
                                                               [](auto& i) { i.width = 15; });
}

}  // namespace splat::test
