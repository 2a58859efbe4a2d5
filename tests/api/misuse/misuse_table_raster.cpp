// The rows of cameras and rasterizers.
#include <array>
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr double kZero[16] = {};
constexpr double kEye[3] = {0, 0, -4};
constexpr double kUp[3] = {0, -1, 0};
constexpr const char* kNoRasterFile = "/nonexistent/transforms.json";

}  // namespace

void MisuseTable::camera_rows() {
    const auto from_fov = [this](std::uint32_t width, std::uint32_t height, double fov) {
        return splat_camera_from_fov(width, height, fov, out<splat_camera>());
    };
    for (const std::uint32_t side : {0U, 16385U, UINT32_MAX}) {
        add("splat_camera_from_fov", "width", "out of range", kArgument,
            [from_fov, side] { return from_fov(side, 8, 0.7); });
        add("splat_camera_from_fov", "height", "out of range", kArgument,
            [from_fov, side] { return from_fov(8, side, 0.7); });
    }
    for (const double fov : {-1.0, 0.0, 3.2, static_cast<double>(NAN)})
        add("splat_camera_from_fov", "fov_x", "out of range", kArgument,
            [from_fov, fov] { return from_fov(8, 8, fov); });
    using Look = std::array<const double*, 3>;
    const auto look = [this](const char* parameter, const char* what, const Look& at) {
        add("splat_camera_look_at", parameter, what, kArgument,
            [this, at] { return splat_camera_look_at(out<splat_camera>(), at[0], at[1], at[2]); });
    };
    look("eye", "NULL", {nullptr, kZero, kUp});
    look("target", "NULL", {kEye, nullptr, kUp});
    look("up", "NULL", {kEye, kZero, nullptr});
    look("target", "the eye", {kEye, kEye, kUp});
    look("up", "along the view", {kEye, kZero, kEye});
    look("up", "zero", {kEye, kZero, kZero});
    for (const double* matrix : {static_cast<const double*>(nullptr), kZero + 0})
        add("splat_camera_from_opengl", "camera_to_world", matrix != nullptr ? "zeros" : "NULL",
            kArgument,
            [this, matrix] { return splat_camera_from_opengl(out<splat_camera>(), matrix); });
    add("splat_camera_orbit", "count", "0: no cameras", SPLAT_OK,
        [this] { return splat_camera_orbit(scene_, nullptr, 0, out<splat_camera>()); });
    add("splat_camera_orbit", "cameras", "NULL", kArgument,
        [this] { return splat_camera_orbit(scene_, nullptr, 1, nullptr); });
}

void MisuseTable::camera_file_rows() {
    const auto load = [this](const splat_camera_file_desc* desc) {
        return splat_camera_load(kNoRasterFile, desc, out<splat_camera>(), 1, out<std::uint32_t>());
    };
    const auto report = [this](const splat_camera_file_desc* desc) {
        return splat_camera_load_report(kNoRasterFile, desc, text_out(), 16, out<std::size_t>());
    };
    for (const char* parameter : {"path", "capacity", "count"})
        add("splat_camera_load", parameter, "of a missing file", kNotFound,
            [load] { return load(nullptr); });
    add("splat_camera_load", "cameras", "NULL", kArgument, [this] {
        return splat_camera_load(kNoRasterFile, nullptr, nullptr, 1, out<std::uint32_t>());
    });
    for (const char* parameter : {"path", "buffer", "capacity", "needed"})
        add("splat_camera_load_report", parameter, "of a missing file", kNotFound,
            [report] { return report(nullptr); });
}

void MisuseTable::rasterizer_rows() {
    const auto invalid = wrong_descs<splat_rasterizer_desc>("splat_rasterizer_create");
    using Desc = splat_rasterizer_desc;
    invalid("no width", kArgument, [](Desc& d) { d.width = 0; });
    invalid("no height", kArgument, [](Desc& d) { d.height = 0; });
    invalid("too wide", SPLAT_ERROR_UNSUPPORTED, [](Desc& d) { d.width = UINT32_MAX; });
    invalid("too many", SPLAT_ERROR_UNSUPPORTED, [](Desc& d) { d.gaussians = UINT32_MAX; });
    invalid("too many views", SPLAT_ERROR_UNSUPPORTED, [](Desc& d) { d.views = UINT32_MAX; });
    invalid("a degree too high", kArgument, [](Desc& d) { d.sh_degree = 4; });
    invalid("unknown skips", kArgument, [](Desc& d) { d.disabled_skips = 64; });
    invalid("an unknown convention", kArgument, [](Desc& d) { d.convention = 3; });
    invalid("a negative convention", kArgument, [](Desc& d) { d.convention = -1; });
    invalid("a negative near plane", kArgument, [](Desc& d) { d.near_plane = -1; });
    invalid("a near plane that is NaN", kArgument, [](Desc& d) { d.near_plane = NAN; });
    invalid("far before near", kArgument, [](Desc& d) { d.far_plane = 0.1F; });
    invalid("poses in 3dgs", kArgument, [](Desc& d) { d.flags = SPLAT_RASTERIZER_GRAD_POSE; });
    invalid("the original gradient in gsplat", kArgument, [](Desc& d) {
        d.flags = SPLAT_RASTERIZER_ORIGINAL_GRADIENT;
        d.convention = SPLAT_CONVENTION_GSPLAT;
    });
    invalid("bands of direct colours", kArgument,
            [](Desc& d) { d.flags = SPLAT_RASTERIZER_DIRECT_COLORS; });
}

void MisuseTable::rasterizer_forward_rows() {
    const splat_camera good = sample_camera(16, 16);
    const auto gaussians = sized<splat_gaussians_desc>();
    const auto both = [this, gaussians](const char* parameter, const char* what,
                                        const splat_camera* camera, std::uint32_t count,
                                        float background) {
        const bool null = camera == nullptr;
        const splat_camera copy = null ? splat_camera{} : *camera;
        add("splat_rasterizer_forward_scene", parameter, what, kArgument,
            [this, null, copy, count, background] {
                const float color[3] = {0, background, 0};
                return splat_rasterizer_forward_scene(rasterizer_, nullptr, scene_,
                                                      null ? nullptr : &copy, count, color);
            });
        add("splat_rasterizer_forward", parameter, what, kArgument,
            [this, null, copy, count, background, gaussians] {
                const float color[3] = {0, background, 0};
                return splat_rasterizer_forward(rasterizer_, nullptr, &gaussians,
                                                null ? nullptr : &copy, count, color);
            });
    };
    both("cameras", "NULL", nullptr, 1, 0);
    both("count", "more than views", &good, 2, 0);
    add("splat_rasterizer_forward_scene", "count", "more than the device takes",
        SPLAT_ERROR_UNSUPPORTED, [this, good] {
            return splat_rasterizer_forward_scene(drawn_, nullptr, scene_, &good, UINT32_MAX,
                                                  nullptr);
        });
    both("background", "not finite", &good, 1, INFINITY);
    const auto invalid = [&](const char* what, void (*change)(splat_camera&)) {
        splat_camera camera = good;
        change(camera);
        both("cameras", what, &camera, 1, 0);
    };
    invalid("of another width", [](splat_camera& c) { c.width = 15; });
    invalid("of another height", [](splat_camera& c) { c.height = 17; });
    invalid("no focal length", [](splat_camera& c) { c.fx = 0; });
    invalid("a focal length below 0", [](splat_camera& c) { c.fy = -1; });
    invalid("a centre that is not finite", [](splat_camera& c) { c.cx = NAN; });
    invalid("a pose that is not finite", [](splat_camera& c) { c.world_to_camera[3] = INFINITY; });
    invalid("a singular pose", [](splat_camera& c) {
        for (double& value : c.world_to_camera) value = 0;
    });
    const auto forward = [this, good](const splat_gaussians_desc* desc) {
        return splat_rasterizer_forward(rasterizer_, nullptr, desc, &good, 1, nullptr);
    };
    add("splat_rasterizer_forward", "gaussians", "without means", kArgument,
        [this, forward, gaussians] {
            splat_gaussians_desc desc = gaussians;
            desc.scales = tensor_;
            return forward(&desc);
        });
}

void MisuseTable::raster_state_rows() {
    const auto states = [this](const char* function,
                               const std::function<splat_result(splat_raster_state)>& call) {
        add(function, "state", "of another rasterizer", kArgument,
            [this, call] { return call(foreign_state_); });
    };
    states("splat_rasterizer_forward_scene", [this](splat_raster_state s) {
        return splat_rasterizer_forward_scene(rasterizer_, s, scene_, nullptr, 1, nullptr);
    });
    states("splat_rasterizer_forward", [this](splat_raster_state s) {
        const auto gaussians = sized<splat_gaussians_desc>();
        return splat_rasterizer_forward(rasterizer_, s, &gaussians, nullptr, 1, nullptr);
    });
    states("splat_rasterizer_output", [this](splat_raster_state s) {
        return splat_rasterizer_output(rasterizer_, s, SPLAT_OUTPUT_RGB, tensor_);
    });
    states("splat_rasterizer_read", [this](splat_raster_state s) {
        return splat_rasterizer_read(rasterizer_, s, SPLAT_OUTPUT_DEPTHS, values_out(), 64);
    });
    states("splat_rasterizer_read_images", [this](splat_raster_state s) {
        return splat_rasterizer_read_images(rasterizer_, s, SPLAT_OUTPUT_RGB, 0, nullptr, 0);
    });
    states("splat_rasterizer_backward", [this](splat_raster_state s) {
        const auto gradients = sized<splat_gradients_desc>();
        return splat_rasterizer_backward(rasterizer_, s, &gradients);
    });
    states("splat_rasterizer_get_info", [this](splat_raster_state s) {
        auto info = sized<splat_rasterizer_info>();
        return splat_rasterizer_get_info(rasterizer_, s, &info);
    });
}

void MisuseTable::rasterizer_image_rows() {
    const auto read = [this](splat_output output, std::uint32_t first, const splat_image& image) {
        return splat_rasterizer_read_images(drawn_, nullptr, output, first, &image, 1);
    };
    static std::uint8_t bytes[16 * 16 * 4];
    const splat_image good = {bytes, sizeof bytes, SPLAT_PIXEL_U8, 16, 16, 4, 0, 0, 0};
    for (const splat_output output :
         {INT32_MIN, 0, 12, INT32_MAX, static_cast<splat_output>(SPLAT_OUTPUT_RADII)})
        add("splat_rasterizer_read_images", "output", "no image", kArgument,
            [read, good, output] { return read(output, 0, good); });
    for (const char* parameter : {"first", "count"}) {
        add("splat_rasterizer_read_images", parameter, "before a forward call", kState, [this] {
            const splat_image none{};
            return splat_rasterizer_read_images(rasterizer_, nullptr, SPLAT_OUTPUT_RGB, 0, &none,
                                                1);
        });
        add("splat_rasterizer_read_images", parameter, "beyond the views", kArgument,
            [read, good] { return read(SPLAT_OUTPUT_RGB, UINT32_MAX, good); });
    }
    const auto invalid = [&](const char* what, splat_result expected,
                             void (*change)(splat_image&)) {
        splat_image image = good;
        change(image);
        add("splat_rasterizer_read_images", "images", what, expected,
            [read, image] { return read(SPLAT_OUTPUT_RGB, 0, image); });
    };
    invalid("without pixels", kArgument, [](splat_image& i) { i.pixels = nullptr; });
    invalid("of no type", kArgument, [](splat_image& i) { i.type = 4; });
    invalid("too short", kArgument, [](splat_image& i) { i.bytes -= 1; });
    invalid("that overlap", kArgument, [](splat_image& i) { i.row_stride = 60; });
    invalid("too narrow", SPLAT_ERROR_SHAPE_MISMATCH, [](splat_image& i) { i.width = 15; });
    invalid("of two channels", SPLAT_ERROR_SHAPE_MISMATCH, [](splat_image& i) { i.channels = 2; });
}

void MisuseTable::scene_render_rows() {
    constexpr const char* kRender = "splat_scene_render";
    using Desc = splat_scene_render_desc;
    static std::uint8_t bytes[16 * 16 * 4];
    const splat_image good = {bytes, sizeof bytes, SPLAT_PIXEL_U8, 16, 16, 4, 0, 0, 0};
    const splat_camera camera = sample_camera(16, 16);
    const auto render = [=, this](const splat_camera* from, const Desc* desc,
                                  const splat_image* to) {
        return splat_scene_render(scene_, device_, from, 1, desc, to);
    };
    add(kRender, "count", "0: no views", SPLAT_OK,
        [this] { return splat_scene_render(scene_, device_, nullptr, 0, nullptr, nullptr); });
    add(kRender, "cameras", "NULL", kArgument, [=] { return render(nullptr, nullptr, &good); });
    add(kRender, "images", "NULL", kArgument, [=] { return render(&camera, nullptr, nullptr); });
    const auto invalid = [&](const char* what, void (*change)(Desc&)) {
        Desc desc = sized<Desc>();
        change(desc);
        add(kRender, "desc", what, kArgument, [=] { return render(&camera, &desc, &good); });
    };
    invalid("an output of Gaussians", [](Desc& d) { d.output = SPLAT_OUTPUT_RADII; });
    invalid("no output", [](Desc& d) { d.output = 12; });
    invalid("an unknown convention", [](Desc& d) { d.convention = 3; });
    invalid("gradients", [](Desc& d) { d.flags = SPLAT_RASTERIZER_BACKWARD; });
    invalid("a background that is not finite", [](Desc& d) { d.background[2] = NAN; });
    splat_camera none = camera;
    none.width = 0;
    add(kRender, "cameras", "without pixels", kArgument,
        [=] { return render(&none, nullptr, &good); });
    none.width = UINT32_MAX;
    add(kRender, "cameras", "too wide", SPLAT_ERROR_UNSUPPORTED,
        [=] { return render(&none, nullptr, &good); });
    splat_image narrow = good;
    narrow.width = 15;
    add(kRender, "images", "of another size", SPLAT_ERROR_SHAPE_MISMATCH,
        [=] { return render(&camera, nullptr, &narrow); });
}

void MisuseTable::rasterizer_output_rows() {
    for (const splat_output output : {INT32_MIN, -1, 0, 12, INT32_MAX}) {
        add("splat_rasterizer_output", "output", "none", kArgument, [this, output] {
            return splat_rasterizer_output(rasterizer_, nullptr, output, tensor_);
        });
        add("splat_rasterizer_read", "output", "none", kArgument, [this, output] {
            return splat_rasterizer_read(rasterizer_, nullptr, output, values_out(), 64);
        });
    }
    add("splat_rasterizer_output", "tensor", "of another shape", SPLAT_ERROR_SHAPE_MISMATCH,
        [this] { return splat_rasterizer_output(drawn_, nullptr, SPLAT_OUTPUT_RGB, tensor_); });
    add("splat_rasterizer_read", "bytes", "too few", kArgument, [this] {
        return splat_rasterizer_read(drawn_, nullptr, SPLAT_OUTPUT_DEPTHS, values_out(), 11);
    });
    add("splat_rasterizer_read", "rasterizer", "before a forward call", kState, [this] {
        return splat_rasterizer_read(rasterizer_, nullptr, SPLAT_OUTPUT_DEPTHS, values_out(), 64);
    });
    const auto backward = [this](const splat_gradients_desc* desc) {
        return splat_rasterizer_backward(rasterizer_, nullptr, desc);
    };
    const auto good = sized<splat_gradients_desc>();
    add("splat_rasterizer_backward", "gradients", "before a forward call", kState,
        [backward, good] { return backward(&good); });
}

}  // namespace splat::test
