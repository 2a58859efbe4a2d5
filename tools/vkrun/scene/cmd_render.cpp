// vkrun render: images of a scene, from the cameras of a file or from an orbit.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <set>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/path_name.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/progress.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/text.h"
#include "vkrun/scene/camera_file.h"
#include "vkrun/scene/memory.h"
#include "vkrun/scene/render_options.h"
#include "vkrun/scene/scene_file.h"
#include "vkrun/view/scene_viewer.h"

namespace vkrun {
namespace {

constexpr const char* kRenderFooter =
    R"(Give one of --cameras, --orbit and --path. Images are named after those of the camera file, or numbered:
NAME.png, and with --outputs also NAME_alpha, NAME_depth, NAME_median and NAME_normal. A .npy holds the
float32 numbers. In a .png, 0 to 1 become 0 to 255; depths (expected or median, along z) are divided by the
largest of the image; normals, in the axes of the camera, are mapped from -1..1 to 0..1. Images of an orbit or a
path get a transforms.json with their cameras, which 'vkrun fit' takes.

A scene is drawn as its file says, unless --drawn-as says otherwise: with opacities that compensate for the dilation
(antialiased), blended by the distance to the camera rather than by depth (by-distance), cut at 3 sigma (3-sigma), or
blended linear and converted to sRGB (linear-colours; --background is sRGB, too). The last line names what was done.

With --convention ray_maximum a pixel sees each Gaussian where it is densest along the pixel's ray, without a dilation
(Yu et al. 2024, Gaussian Opacity Fields), as F3D-Gaus draws what its weights predict.

A path goes smoothly through all cameras of its file, by equal steps, with the lens of the first one. ffmpeg makes a
video of its frames: ffmpeg -framerate 30 -i path/%04d.png -pix_fmt yuv420p path.mp4

Exit status: 0 all images are written, 1 an image cannot be written or the device failed, 2 wrong
usage, 3 no device, 4 the scene or the cameras cannot be read, or no orbit fits the scene.

Examples:
  vkrun render scene.ply --orbit 36 --size 800x600 --animate --out orbit
  vkrun render scene.ply --orbit 36 --animate orbit.gif --out orbit
  vkrun render scene.ply --orbit 8 --page orbit/index.html --out orbit
  vkrun render run/scene.ply --path photos --frames 240 --closed --convention gsplat --out path
  vkrun render scene.ply --cameras transforms.json --convention gsplat --out renders
  vkrun render scene.spz --cameras colmap/ --outputs rgb,depth --format npy --out renders
)";

constexpr double kElevation = 11;  ///< degrees

/// One kind of image that is written.
struct OutputKind {
    const char* name;
    const char* suffix;
    splat_output output;
    std::uint32_t channels;
    std::uint32_t flag;
};

constexpr OutputKind kKinds[] = {
    {"rgb", "", SPLAT_OUTPUT_RGB, 3, 0},
    {"alpha", "_alpha", SPLAT_OUTPUT_ALPHA, 1, 0},
    {"depth", "_depth", SPLAT_OUTPUT_EXPECTED_DEPTH, 1, SPLAT_RASTERIZER_DEPTH},
    {"median", "_median", SPLAT_OUTPUT_MEDIAN_DEPTH, 1, SPLAT_RASTERIZER_MEDIAN_DEPTH},
    {"normal", "_normal", SPLAT_OUTPUT_NORMALS, 3, SPLAT_RASTERIZER_NORMALS},
};

std::vector<OutputKind> kinds_of(const RenderOptions& options) {
    std::vector<OutputKind> kinds;
    for (const OutputKind& kind : kKinds)
        if (std::find(options.outputs.begin(), options.outputs.end(), kind.name) !=
            options.outputs.end())
            kinds.push_back(kind);
    return kinds;
}

struct View {
    PathName name;
    splat_camera camera;
};

std::vector<View> orbit_views(const RenderOptions& options, splat_scene scene) {
    std::vector<View> views;
    for (const splat_camera& camera :
         orbit_cameras(scene, image_size(options.size), options.elevation.value_or(kElevation),
                       options.distance.value_or(0), options.orbit))
        views.push_back({PathName(format("%03zu", views.size())), camera});
    return views;
}

/// Views named after the images, without folder and extension; all are numbered if two files would have one name.
std::vector<View> file_views(const RenderOptions& options) {
    const CameraFile file =
        load_cameras(options.cameras, {image_size(options.size), options.ignore_distortion});
    print_warnings(file);
    std::set<std::string> seen;
    bool distinct = true;
    std::vector<std::string> names;
    for (const std::string& image : file.names) {
        names.push_back(splat::os::text_of(splat::os::path_of(image).stem()));
        for (const OutputKind& kind : kinds_of(options))
            distinct = seen.insert(PathName(names.back()).text() + kind.suffix).second &&
                       !names.back().empty() && distinct;
    }
    std::vector<View> views;
    for (std::size_t i = 0; i < names.size(); ++i)
        views.push_back(
            {PathName(distinct ? names[i] : format("%04zu_", i) + names[i]), file.cameras[i]});
    return views;
}

/// Numbered views along the path through the cameras of a file, by the names of their images.
std::vector<View> path_views(const RenderOptions& options) {
    CameraFile file = load_cameras(cameras_in(options.path),
                                   {.size = image_size(options.size), .ignore_distortion = true});
    std::vector<std::size_t> order(file.cameras.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return file.names[a] < file.names[b]; });
    std::vector<splat_camera> keys, cameras(options.frames);
    for (const std::size_t i : order) keys.push_back(file.cameras[i]);
    if (keys.empty()) throw Failure(kBadData, "'" + options.path + "' has no cameras");
    check(splat_camera_path(keys.data(), static_cast<std::uint32_t>(keys.size()),
                            options.closed ? 1 : 0, options.frames, cameras.data()),
          kBadData);
    std::vector<View> views;
    for (const splat_camera& camera : cameras)
        views.push_back({PathName(format("%04zu", views.size())), camera});
    return views;
}

/// SPLAT_DRAWN_ bits.
std::uint32_t drawn_as(const RenderOptions& options, const SceneFile& file) {
    const std::uint32_t drawn = drawn_bits(options.drawn_as, file.info.drawn_as) |
                                (options.antialiased ? SPLAT_DRAWN_ANTIALIASED : 0);
    if (options.convention == "ray_maximum" && (drawn & SPLAT_DRAWN_ANTIALIASED) != 0)
        throw Failure(kUsageError,
                      "--convention ray_maximum has no antialiasing: leave out --antialiased, and "
                      "give --drawn-as plain if the scene's file asks for it");
    return drawn;
}

/// Draws views of one scene; a change of size replaces the rasterizer.
class Renderer {
  public:
    Renderer(const RenderOptions& options, const SceneFile& file)
        : options_(options),
          file_(file),
          kinds_(kinds_of(options)),
          drawn_as_(drawn_as(options, file)) {
        device_ = open_device(device_desc(options.device));
    }

    splat_rasterizer_info draw(const splat_camera& camera) {
        prepare(camera);
        check(splat_rasterizer_forward_scene(rasterizer_.get(), nullptr, file_.scene.get(), &camera,
                                             1, options_.background.data()));
        auto info = sized<splat_rasterizer_info>();
        check(splat_rasterizer_get_info(rasterizer_.get(), nullptr, &info));
        return info;
    }

    /// Converted as splat_image_save does.
    std::vector<std::uint8_t> read_bytes(const OutputKind& kind) {
        std::vector<std::uint8_t> bytes(std::size_t{width_} * height_ * kind.channels);
        const splat_image image = bytes_image(bytes.data(), width_, height_, kind.channels);
        check(splat_rasterizer_read_images(rasterizer_.get(), nullptr, kind.output, 0, &image, 1));
        return bytes;
    }

    std::vector<float> read(const OutputKind& kind) {
        std::vector<float> values(std::size_t{width_} * height_ * kind.channels);
        const splat_image image = interleaved_image(values.data(), width_, height_, kind.channels);
        check(splat_rasterizer_read_images(rasterizer_.get(), nullptr, kind.output, 0, &image, 1));
        return values;
    }

    [[nodiscard]] splat_device_info device() const { return info_of(device_.get()); }
    [[nodiscard]] const std::vector<OutputKind>& kinds() const { return kinds_; }

    /// Make the rasterizer for images of this camera's size.
    void prepare(const splat_camera& camera) {
        if (width_ == camera.width && height_ == camera.height) return;
        if (file_.info.count > UINT32_MAX) throw Failure(kFailed, "too many Gaussians");
        auto desc = sized<splat_rasterizer_desc>();
        desc.gaussians = static_cast<std::uint32_t>(file_.info.count);
        desc.sh_degree = file_.info.sh_degree;
        desc.width = width_ = camera.width;
        desc.height = height_ = camera.height;
        desc.convention = options_.convention == "gsplat"        ? SPLAT_CONVENTION_GSPLAT
                          : options_.convention == "ray_maximum" ? SPLAT_CONVENTION_RAY_MAXIMUM
                                                                 : SPLAT_CONVENTION_3DGS;
        desc.near_plane = options_.near_plane.value_or(0.0F);
        desc.far_plane = options_.far_plane.value_or(0.0F);
        desc.flags = drawn_as_;
        for (const OutputKind& kind : kinds_) desc.flags |= kind.flag;
        rasterizer_ = Rasterizer();
        check(splat_rasterizer_create(device_.get(), &desc, rasterizer_.out()));
    }

  private:
    const RenderOptions& options_;
    const SceneFile& file_;
    std::vector<OutputKind> kinds_;
    std::uint32_t drawn_as_;
    Device device_;
    Rasterizer rasterizer_;
    std::uint32_t width_ = 0;
    std::uint32_t height_ = 0;
};

/// True if values of 0 to 1 are what a PNG holds; others are mapped first.
bool is_picture(const OutputKind& kind) {
    return kind.output == SPLAT_OUTPUT_RGB || kind.output == SPLAT_OUTPUT_ALPHA;
}

/// Map values to the range from 0 to 1.
void to_picture(const OutputKind& kind, std::vector<float>& values) {
    if (kind.output == SPLAT_OUTPUT_NORMALS)
        for (float& value : values) value = 0.5F + 0.5F * value;
    if (kind.output != SPLAT_OUTPUT_EXPECTED_DEPTH && kind.output != SPLAT_OUTPUT_MEDIAN_DEPTH)
        return;
    const float most = *std::max_element(values.begin(), values.end());
    for (float& value : values) value = most > 0 ? value / most : 0;
}

std::string path_of(const RenderOptions& options, const PathName& name, const OutputKind& kind) {
    if (!options.file.empty()) return options.file;
    const std::string file = name.text() + kind.suffix + "." + options.format;
    return splat::os::text_of(splat::os::path_of(options.out) / splat::os::path_of(file));
}

Json render_view(const RenderOptions& options, Renderer& renderer, const View& view,
                 std::vector<std::uint8_t>& frames) {
    const Stopwatch watch;
    const splat_rasterizer_info info = renderer.draw(view.camera);
    const double ms = watch.ms();
    Json files = Json::array();
    for (const OutputKind& kind : renderer.kinds()) {
        const std::string path = path_of(options, view.name, kind);
        const bool framed = options.animate && kind.output == SPLAT_OUTPUT_RGB;
        const bool direct = options.format == "png" && is_picture(kind);
        const auto [width, height] = std::pair(view.camera.width, view.camera.height);
        std::vector<std::uint8_t> bytes;
        if (framed || direct) bytes = renderer.read_bytes(kind);
        if (framed) frames.insert(frames.end(), bytes.begin(), bytes.end());
        if (direct) {
            const splat_image image = bytes_image(bytes.data(), width, height, kind.channels);
            check(splat_image_save(path.c_str(), &image));
        } else {
            std::vector<float> values = renderer.read(kind);
            if (options.format == "png") to_picture(kind, values);
            const splat_image image =
                interleaved_image(values.data(), width, height, kind.channels);
            check(splat_image_save(path.c_str(), &image));
        }
        files.push_back(path);
    }
    return {{"name", view.name.text()},      {"width", view.camera.width},
            {"height", view.camera.height},  {"ms", ms},
            {"visible", info.visible},       {"culled", info.culled},
            {"non_finite", info.non_finite}, {"pairs", info.pairs},
            {"files", std::move(files)}};
}

/// The file of the cameras of an orbit or path; empty: none is written.
std::string cameras_path(const RenderOptions& options) {
    const bool pictures =
        options.format == "png" && kinds_of(options).front().output == SPLAT_OUTPUT_RGB;
    if (!options.cameras.empty() || !options.file.empty() || !pictures) return {};
    return splat::os::text_of(splat::os::path_of(options.out) / "transforms.json");
}

void save_cameras(const RenderOptions& options, const std::vector<View>& views) {
    const OutputKind kind = kinds_of(options).front();
    std::vector<splat_camera> cameras;
    std::vector<std::string> files;
    std::vector<const char*> names;
    for (const View& view : views) {
        cameras.push_back(view.camera);
        files.push_back(
            splat::os::text_of(splat::os::path_of(path_of(options, view.name, kind)).filename()));
    }
    for (const std::string& file : files) names.push_back(file.c_str());
    check(splat_camera_save(cameras_path(options).c_str(), cameras.data(), names.data(),
                            static_cast<std::uint32_t>(cameras.size())));
}

void check_targets(const RenderOptions& options, const std::vector<View>& views) {
    std::set<std::filesystem::path> targets;
    const std::string keys = options.path.empty() ? "" : cameras_in(options.path);
    const auto check = [&](const std::string& path) {
        check_target(path, options.overwrite, {options.scene, options.cameras, keys});
        const auto place =
            std::filesystem::weakly_canonical(std::filesystem::absolute(splat::os::path_of(path)));
        if (!targets.insert(place).second)
            throw Failure(kUsageError, "'" + path +
                                           "' would be written twice: name another file with "
                                           "--animate or --page");
    };
    if (options.animate) check(options.animation);
    if (!options.page.empty()) check(options.page);
    if (!cameras_path(options).empty()) check(cameras_path(options));
    for (const View& view : views) {
        for (const OutputKind& kind : kinds_of(options)) check(path_of(options, view.name, kind));
        const splat_camera& first = views.front().camera;
        if (options.animate &&
            (view.camera.width != first.width || view.camera.height != first.height))
            throw Failure(kUsageError, "--animate needs cameras of one size");
    }
}

/// The images of the first views and the scene that turns, in one page.
void write_render_page(const RenderOptions& options, const SceneFile& file,
                       const std::vector<View>& views) {
    constexpr std::size_t kMostShown = 36;
    HtmlPage page("Views of " + splat::os::text_of(splat::os::path_of(options.scene).filename()));
    ViewerOptions viewer;
    viewer.name = splat::os::text_of(splat::os::path_of(options.scene).filename());
    viewer.file = plain_ply_name(options.scene);
    for (const View& view : views) viewer.cameras.push_back(view.camera);
    viewer.instead = "The pictures show it.";
    viewer.drawn_as = drawn_as(options, file);
    std::copy_n(options.background.begin(), 3, viewer.background);
    if (options.orbit == 0) up_of(viewer.cameras, viewer.up);
    try {
        const ViewerFacts facts = add_viewer(page, file.scene.get(), viewer);
        for (const std::string& note : facts.notes)
            std::fprintf(stderr, "vkrun: warning: %s\n", note.c_str());
    } catch (const Failure& failure) {  // such as a scene in which nothing can be seen
        const std::string why = std::string("The scene does not turn here: ") + failure.what();
        page.paragraph(why);
        std::fprintf(stderr, "vkrun: warning: '%s': %s\n", options.page.c_str(), why.c_str());
    }
    if (views.size() > kMostShown)
        page.paragraph(format("The first %zu of %zu views:", kMostShown, views.size()));
    for (std::size_t i = 0; i < std::min(kMostShown, views.size()); ++i)
        for (const OutputKind& kind : kinds_of(options))
            page.picture(path_of(options, views[i].name, kind), views[i].name.text() + kind.suffix,
                         240);
    replace_file(options.page, page.text());
}

int run_render(RenderOptions options) {
    if (options.path == "orbit") {
        if (options.orbit != 0)
            throw Failure(kUsageError,
                          "--path orbit has its number of cameras from --frames: leave "
                          "out --orbit");
        if (options.closed)
            throw Failure(kUsageError,
                          "--closed is for a path through cameras; an orbit is closed already");
        options.path.clear();
        options.orbit = options.frames;
    }
    check_render_options(options);
    const auto reading = scene_file_desc(options.lenient);
    check_memory(options.scene, reading, options.memory, {{}, -1, options.device, {}, false});
    const SceneFile file = load_scene(options.scene, &reading);
    const std::vector<View> views = options.orbit > 0      ? orbit_views(options, file.scene.get())
                                    : options.path.empty() ? file_views(options)
                                                           : path_views(options);
    if (views.empty()) throw Failure(kBadData, "'" + options.cameras + "' has no cameras");
    if (options.orbit == 0)
        for (const View& view : views)
            check_distance(view.name.text(), view.camera, file.info, options.lenient);
    place_images(options, views.size() * kinds_of(options).size());
    check_targets(options, views);
    Renderer renderer(options, file);
    renderer.prepare(views.front().camera);  // a refusal leaves no folder behind
    if (!options.out.empty()) make_folder(options.out);
    const Stopwatch watch;
    Json list = Json::array();
    std::vector<std::uint8_t> frames;
    {
        Progress progress("render", views.size());
        for (const View& view : views) {
            progress.show(list.size());
            list.push_back(render_view(options, renderer, view, frames));
        }
    }
    if (options.animate) {
        const splat_camera& camera = views.front().camera;
        std::vector<splat_image> images;
        for (std::size_t i = 0; i < views.size(); ++i)
            images.push_back(bytes_image(frames.data() + i * frames.size() / views.size(),
                                         camera.width, camera.height, 3));
        check(splat_image_save_animation(options.animation.c_str(), images.data(),
                                         static_cast<std::uint32_t>(images.size()), 50));
    }
    if (!options.page.empty()) write_render_page(options, file, views);
    if (!cameras_path(options).empty()) save_cameras(options, views);
    const double seconds = watch.seconds();
    if (options.json) {
        Json document = {{"scene", options.scene},
                         {"gaussians", file.info.count},
                         {"device", renderer.device().name},
                         {"convention", options.convention},
                         {"drawn_as", drawn_names(drawn_as(options, file))},
                         {"seconds", seconds},
                         {"views", std::move(list)}};
        if (options.animate) document["animation"] = options.animation;
        if (!options.page.empty()) document["page"] = options.page;
        print_json(document);
    } else {
        std::string how;
        for (const std::string& name : drawn_names(drawn_as(options, file))) how += ", " + name;
        std::printf("%s: %zu views of %llu Gaussians in %.2f s on %s%s\n",
                    (options.file.empty() ? options.out : options.file).c_str(), views.size(),
                    static_cast<unsigned long long>(file.info.count), seconds,
                    renderer.device().name, how.c_str());
    }
    return kSuccess;
}

}  // namespace

void add_render(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(app, "render", "Render images of a scene.", kRenderFooter);
    const auto options = std::make_shared<RenderOptions>();
    add_render_options(*command, *options);
    command->callback([options, &exit_code] { exit_code = run_render(*options); });
}

}  // namespace vkrun
