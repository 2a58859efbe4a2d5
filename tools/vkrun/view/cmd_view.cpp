// vkrun view: a page in which a scene turns.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/temporary_folder.h"
#include "vkrun/cli/text.h"
#include "vkrun/scene/camera_file.h"
#include "vkrun/scene/scene_file.h"
#include "vkrun/view/scene_viewer.h"

namespace vkrun {
namespace {

constexpr const char* kViewFooter =
    R"(The page holds the scene and the script that draws it (WebGL2), and loads nothing from elsewhere. Drag to turn,
the right button or two fingers to move, wheel or pinch to zoom; arrows, + and - do the same, digits go to the
views, and the page lists the other keys. It draws as 'vkrun render' does in the 3dgs convention, and as the scene's
file says (--drawn-as). A link saves the Gaussians of the page as a .ply file.

The page has 24 bytes for each Gaussian, and 12, 24 or 48 more for harmonics of degree 1, 2 or 3: means are
float32, log scales have 10 or 11 bits, rotations 32 bits, colours, opacities and harmonics 8 bits a number. What
is not finite or cannot be seen is left out; of more than --most Gaussians, those of the largest opacity times area
are kept. The page says so.

Browsers without WebGL2 or scripts show still pictures of the views, which need a device; --stills 0 needs none.

Exit status: 0 done, 1 the page cannot be written or the device failed, 2 wrong usage, 3 no device, 4 the scene or
the cameras cannot be read, or nothing of the scene can be seen.

Examples:
  vkrun view scene.ply
  vkrun view scene.spz --background 1,1,1 --out pages/guitar.html
  vkrun view scene.ply --cameras transforms.json --most 500000 --stills 0
)";

struct ViewOptions {
    std::string scene, cameras, out = "view.html", size;
    std::uint32_t stills = 3;
    std::optional<std::uint32_t> orbit;
    std::optional<double> elevation, distance;
    std::vector<float> background = {0, 0, 0};
    std::uint64_t most = kPageGaussians;
    std::vector<std::string> drawn_as = {"file"};
    bool turn = false, overwrite = false, json = false;
    std::string device = "best";
};

constexpr std::uint32_t kOrbitViews = 3;
constexpr double kViewElevation = 11;  ///< degrees, as of 'vkrun render'

std::vector<splat_camera> view_cameras(const ViewOptions& options, splat_scene scene) {
    const ImageSize size = image_size(options.size);
    if (!options.cameras.empty()) {
        CameraFile file = load_cameras(options.cameras, {size, true});
        print_warnings(file);
        if (file.cameras.empty())
            throw Failure(kBadData, "'" + options.cameras + "' has no cameras");
        return file.cameras;
    }
    return orbit_cameras(scene, size, options.elevation.value_or(kViewElevation),
                         options.distance.value_or(0), options.orbit.value_or(kOrbitViews));
}

/// Pictures of the page's first views, in `folder`.
std::vector<std::string> draw_stills(const ViewOptions& options, splat_scene scene,
                                     const std::vector<splat_camera>& cameras,
                                     const std::string& folder) {
    std::vector<std::string> files;
    if (options.stills == 0) return files;
    const Device device = open_device(device_desc(options.device));
    Rasterizer rasterizer;
    std::uint32_t width = 0, height = 0;
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene, &info));
    for (const std::size_t number : view_numbers(cameras.size())) {
        if (files.size() == options.stills) break;
        const splat_camera& camera = cameras[number];
        if (camera.width != width || camera.height != height) {
            auto desc = sized<splat_rasterizer_desc>();
            desc.gaussians = static_cast<std::uint32_t>(info.count);
            desc.sh_degree = info.sh_degree;
            desc.flags = drawn_bits(options.drawn_as, info.drawn_as);
            desc.width = width = camera.width;
            desc.height = height = camera.height;
            rasterizer = Rasterizer();
            check(splat_rasterizer_create(device.get(), &desc, rasterizer.out()));
        }
        check(splat_rasterizer_forward_scene(rasterizer.get(), nullptr, scene, &camera, 1,
                                             options.background.data()));
        std::vector<std::uint8_t> bytes(std::size_t{3} * width * height);
        const splat_image image = bytes_image(bytes.data(), width, height, 3);
        check(splat_rasterizer_read_images(rasterizer.get(), nullptr, SPLAT_OUTPUT_RGB, 0, &image,
                                           1));
        files.push_back(folder + format("/%zu.png", number));
        check(splat_image_save(files.back().c_str(), &image));
    }
    return files;
}

int run_view(const ViewOptions& options) {
    const std::string out = one_file(options.out, "view.html");
    if (!options.cameras.empty() && (options.orbit || options.elevation || options.distance))
        throw Failure(kUsageError,
                      std::string(options.orbit       ? "--orbit"
                                  : options.elevation ? "--elevation"
                                                      : "--distance") +
                          " is for an orbit; the file of --cameras places its cameras itself");
    if (options.elevation) check_number("--elevation", *options.elevation, -89, 89);
    if (options.distance) check_number("--distance", *options.distance, 1e-6, 1e9);
    check_background(options.background);
    check_target(out, options.overwrite, {options.scene, options.cameras});
    const SceneFile scene = load_scene(options.scene);
    const std::filesystem::path path = splat::os::path_of(options.scene);
    ViewerOptions viewer;
    viewer.name = splat::os::text_of(path.filename());
    viewer.file = plain_ply_name(options.scene);
    viewer.drawn_as = drawn_bits(options.drawn_as, scene.info.drawn_as);
    ScenePayload payload = pack_scene(scene.scene.get(), options.most);
    viewer.cameras = view_cameras(options, scene.scene.get());
    const TemporaryFolder folder;
    viewer.stills = draw_stills(options, scene.scene.get(), viewer.cameras, folder.path());
    std::copy_n(options.background.begin(), 3, viewer.background);
    if (!options.cameras.empty()) up_of(viewer.cameras, viewer.up);
    viewer.turning = options.turn;
    viewer.full_window = true;
    HtmlPage page(viewer.name);
    const ViewerFacts facts = add_viewer(page, std::move(payload), viewer);
    for (const std::string& note : facts.notes)
        std::fprintf(stderr, "vkrun: warning: %s\n", note.c_str());
    const std::string text = page.text();
    make_folder_of(out);
    replace_file(out, text);
    if (options.json)
        print_json({{"page", out},
                    {"bytes", text.size()},
                    {"gaussians", facts.gaussians},
                    {"faint", facts.faint},
                    {"notes", facts.notes},
                    {"drawn_as", drawn_names(*viewer.drawn_as)},
                    {"views", facts.views}});
    else
        std::printf("%s: %llu Gaussians (%llu faint ones were left out), %s\n", out.c_str(),
                    static_cast<unsigned long long>(facts.gaussians),
                    static_cast<unsigned long long>(facts.faint), bytes_text(text.size()).c_str());
    return kSuccess;
}

}  // namespace

void add_view(CLI::App& app, int& exit_code) {
    CLI::App* command =
        add_command(app, "view", "Write a page in which a scene turns.", kViewFooter);
    auto options = std::make_shared<ViewOptions>();
    ViewOptions& o = *options;
    command->add_option("SCENE", o.scene, "Scene: " + scene_extensions())
        ->required()
        ->type_name("");
    command->add_option("--out", o.out, "Page to write, or a folder for view.html")
        ->type_name("FILE")
        ->capture_default_str();
    command
        ->add_option("--cameras", o.cameras,
                     "Views: transforms.json, or the folder of a COLMAP\nmodel; of more than nine, "
                     "six evenly spread")
        ->type_name("FILE");
    command
        ->add_option("--orbit", o.orbit, "Views on a circle around the scene, 1 to 9; default: 3")
        ->type_name("N")
        ->check(CLI::Range(1, 9).description(""));
    command
        ->add_option("--elevation", o.elevation,
                     "Degrees of the orbit above the horizon; default: 11")
        ->type_name("DEG");
    command
        ->add_option(
            "--distance", o.distance,
            "Radius of the orbit, in scene units; default: all of\nthe scene is in every picture")
        ->type_name("X");
    command
        ->add_option("--size", o.size,
                     "Size of the still pictures, for an orbit (default:\n512x512) or a camera "
                     "file that does "
                     "not give it")
        ->type_name("WxH");
    add_count_option(*command, "--stills", o.stills, "Still pictures of the first views", 0, 9);
    command->add_option("--background", o.background, "Background colour, each channel 0 to 1")
        ->type_name("R,G,B")
        ->default_str("0,0,0")
        ->delimiter(',')
        ->expected(3);
    add_drawn_as_option(*command, o.drawn_as);
    command->add_option("--most", o.most, "Gaussians that the page holds at most")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 5'000'000).description(""));
    command->add_flag("--turn", o.turn, "The scene turns by itself until it is touched");
    command->add_flag("--overwrite", o.overwrite, "Replace the page if it exists");
    add_device_option(*command, o.device);
    add_json_flag(*command, o.json);
    command->callback([options, &exit_code] { exit_code = run_view(*options); });
}

}  // namespace vkrun
