// vkrun priors depth, normal, mask, edges, plane: maps of pictures, by a network or without.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/priors/map_maker.h"

namespace vkrun {
namespace {

// The help of a map is put together of these.

constexpr const char* kInText =
    R"(IN is a picture, a folder of pictures, or a data set: a folder with folders rgb/ at any depth, as SRN's. DIR gets
%s/NAME.png, and of a data set the same layout as IN has: OBJECT/%s/NAME.png, which --out IN writes into the data
set itself.

)";

constexpr const char* kModelText =
    R"(--preset names a kind of model, whose file is looked for in the folder that 'vkrun priors where NAME' prints;
--model names the file. The maps have the size of their pictures. ONNX Runtime runs .onnx files; weights of MoGe-2
(.pt, .safetensors) run on --device, and need no such library. --all writes the maps of one pass.

)";

constexpr const char* kDepthText =
    R"(A depth map has 8 bits, truncated as the reference's scripts do, from the picture's farthest (0) to its nearest
(255); png16 has the same numbers in 16 bits, npy float32 as the model gives them: inverse depth or distances.

)";

constexpr const char* kNormalText =
    R"(A normal map has (n + 1) * 127.5 in 8 bits, truncated as the reference's scripts do; png16 has the same numbers
in 16 bits, npy float32 as the model gives them.

--from-depth makes normals of depth maps by the camera, without a model: .npy maps hold distances, others relative
depth, from 1 / FAR (0) to 1 / NEAR (255). The .npy maps of presets of inverse depth, such as midas-small, hold neither.

)";

constexpr const char* kMaskText =
    R"(A mask is 255 on the object and 0 around it. Without a model it is the picture's alpha, unless that is opaque
everywhere, else what differs from the colour of its border: a picture on a plain background needs no model. npy has
0 to 1. A mask that is empty, or takes in the border, is best looked at: 'vkrun data check' names empty ones.

)";

constexpr const char* kEdgesOfMapText =
    R"(--preset edges makes edges of the pictures' gray values, or with --from-depth of depth maps, without a model:
each operator (canny, sobel, scharr, prewitt) is a channel of the map, which a network takes in the place of %s.
'vkrun priors edges' writes each operator as a map of its own name.

)";

constexpr const char* kEdgesText =
    R"(Edges are made of the pictures' gray values, or with --from-depth of depth maps, without a model; each operator
(canny, sobel, scharr, prewitt) is a map of its own name. '--preset edges' of 'vkrun priors depth', 'normal' and
'mask' writes them as channels of those maps.

)";

constexpr const char* kPlaneText =
    R"(A plane map has for each pixel the normal of its plane and the plane's distance from the camera: in npy numbers
in the camera's axes and the unit of the depth; in png and png16 (n + 1) / 2 as red, green and blue and, as alpha, the
distance divided by that of the picture's farthest plane. All four are 0 where there is no plane: pixels of one plane
have the same four numbers.

Planes grow in depth maps that DIR or the data set has: .npy maps hold distances, others relative depth, from 1 / FAR
(0) to 1 / NEAR (255). Depth maps of 8 bits are too coarse for normals: --normals takes those of the normal maps.

)";

constexpr const char* kEndText =
    R"(Existing maps are kept, so a run that was stopped is repeated to go on; a map appears whole or not at all. DIR
gets priors-%s.json, and a run with another model or format does not mix its maps with those. --shard 0/4 to 3/4 on
four machines make a part each (docs/shards.md).

Exit status: 0 done, 1 a file cannot be written, 2 wrong usage, 4 a picture or the model cannot be read, or ONNX
Runtime is missing (the maps of other pictures are made), 5 out of memory, 7 the model's output is not finite.

Examples:
)";

/// What the help of a map says of it alone.
struct MapText {
    const char* map;
    const char* sentence;  ///< describes the command
    const char* numbers;   ///< describes the numbers in the map
    const char* channels;  ///< edges stand for; null: edges themselves
    const char* examples;
};

constexpr MapText kMapTexts[] = {
    {"depth", "Make depth maps of pictures.", kDepthText, "depth (one channel)",
     R"(  vkrun priors depth data/srn_cars --out data/srn_cars --preset midas-dpt-large --shard 0/4
  vkrun priors depth photo.jpg --out maps --preset moge-2-vits-normal --tokens 1200 --all
)"},
    {"normal", "Make normal maps of pictures.", kNormalText, "normals (three channels)",
     R"(  vkrun priors normal photos --out maps --preset moge-2-vits
  vkrun priors normal data/srn_cars --out data/srn_cars --from-depth --distances 0.8 1.8
  vkrun priors normal data/srn_cars --out edges --preset edges --operator canny --operator sobel --operator scharr
)"},
    {"mask", "Make masks of the objects of pictures.", kMaskText, "a mask (one channel)",
     R"(  vkrun priors mask photos --out maps --preset u2net
  vkrun priors mask product_shots --out maps
  vkrun priors mask data/srn_cars --out data/srn_cars --preset birefnet
)"},
    {"edges", "Make edges of pictures or depth maps.", kEdgesText, nullptr,
     R"(  vkrun priors edges photos --out maps
  vkrun priors edges data/srn_cars --out data/srn_cars --from-depth --operator canny
)"},
    {"plane", "Make maps of planes of depth maps.", kPlaneText, nullptr,
     R"(  vkrun priors plane data/srn_chairs --out data/srn_chairs --distances 1.25 2.75 --normals
  vkrun priors plane photos --out maps --fov 60 --format npy
)"}};

std::string help_of(const MapText& text) {
    const char* const folder = text.map == std::string_view("edges") ? "OPERATOR" : text.map;
    std::string help = format(kInText, folder, folder);
    if (text.channels != nullptr) help += kModelText;
    help += text.numbers;
    if (text.channels != nullptr) help += format(kEdgesOfMapText, text.channels);
    return help + format(kEndText, text.map) + text.examples;
}

int run_priors(MapOptions options, bool json) {
    options.edges.use = options.map == "edges" || options.preset == "edges";
    if (options.edges.use && options.edges.operators.empty())
        options.edges.operators = default_operators(options.map);
    if (options.depth.use && !options.edges.use && !options.planes.use && options.map != "normal")
        throw Failure(kUsageError, "--from-depth goes with --preset edges, or makes normals");
    if (options.edges.use && (!options.depth.distances.empty() || options.depth.fov_degrees))
        throw Failure(kUsageError, "--distances and --fov have no effect on edges");
    if (options.depth.fov_degrees) check_number("--fov", *options.depth.fov_degrees, 0.1, 179);
    if (options.depth.use && !options.edges.use)
        options.depth.inverse_preset = inverse_preset_of(options.out);
    const MapReport report = make_maps(options);
    if (json)
        print_json({{"out", options.out},
                    {"maps", report.maps},
                    {"preset", report.preset},
                    {"licence", report.licence},
                    {"made", report.made},
                    {"kept", report.kept},
                    {"failed", report.failed},
                    {"seconds", report.seconds}});
    else
        std::printf("%s: maps of %zu pictures made, %zu kept, %zu failed, %.1f s\n",
                    options.out.c_str(), report.made, report.kept, report.failed, report.seconds);
    if (!json && !report.licence.empty())
        std::printf("model %s: %s\n", report.preset.c_str(), report.licence.c_str());
    return report.failed == 0 ? kSuccess : kBadData;
}

void add_model_options(CLI::App& command, MapOptions& o) {
    command
        .add_option("--preset", o.preset, "Kind of model: a name, or JSON of your own; edges: none")
        ->type_name("NAME");
    command
        .add_option("--model", o.model,
                    "File of the model (ONNX, or weights of MoGe-2); default: that of the preset")
        ->type_name("FILE");
    command.add_option("--runtime", o.runtime, "Library of ONNX Runtime")->type_name("FILE");
    command
        .add_option("--tokens", o.tokens,
                    "Patches of a picture, for presets of MoGe-2; default: the preset's")
        ->type_name("N")
        ->check(CLI::Range(1, 65535).description(""));
    add_device_option(command, o.device);
    command.add_flag("--all", o.all, "Write every map that the model makes in the same pass");
}

void add_edge_options(CLI::App& command, MapOptions& o) {
    command
        .add_option("--operator", o.edges.operators,
                    "Of edges: canny, sobel, scharr or prewitt; once for each channel")
        ->type_name("NAME")
        ->take_all()
        ->expected(1)
        ->allow_extra_args(false)
        ->check(one_of(edge_operators()));
    command.add_flag("--from-depth", o.depth.use,
                     std::string(o.map == "normal"  ? "Normals or edges"
                                 : o.map == "edges" ? "Edges"
                                                    : "With --preset edges: edges") +
                         " of the depth maps in DIR, or of the data set");
}

void add_plane_options(CLI::App& command, PlaneOptions& planes) {
    planes.use = true;
    command.add_flag(
        "--normals", planes.normals,
        "Normals of the normal maps in DIR, or of the data set; default: of the depth");
    const struct {
        const char *name, *about, *type;
        double& value;
        double least, most;
    } rules[] = {{"--degrees", "Most angle between a pixel's normal and its plane's", "DEG",
                  planes.degrees, 0.1, 90},
                 {"--offset", "Most distance of a pixel from its plane, as a share of its depth",
                  "SHARE", planes.offset, 1e-6, 1},
                 {"--least", "Pixels of the smallest plane, as a share of the map's", "SHARE",
                  planes.least, 1e-3, 1}};
    for (const auto& rule : rules)
        command.add_option(rule.name, rule.value, rule.about)
            ->type_name(rule.type)
            ->capture_default_str()
            ->check(CLI::Range(rule.least, rule.most).description(""));
}

void add_map(CLI::App& priors, const MapText& text, int& exit_code) {
    CLI::App* command = add_command(priors, text.map, text.sentence, help_of(text));
    const auto options = std::make_shared<MapOptions>();
    const auto json = std::make_shared<bool>(false);
    MapOptions& o = *options;
    o.map = text.map;
    command->add_option("IN", o.in, "Picture, folder of pictures, or data set")
        ->required()
        ->type_name("");
    command->add_option("--out", o.out, "Folder for the maps")->required()->type_name("DIR");
    if (o.map == "plane")
        o.depth.use = true;
    else if (o.map != "edges")
        add_model_options(*command, o);
    if (o.map != "plane") add_edge_options(*command, o);
    command->add_option("--format", o.format, "png, png16 or npy")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"png", "png16", "npy"}));
    if (o.map == "plane") add_plane_options(*command, o.planes);
    if (o.map == "normal" || o.map == "plane") {
        command
            ->add_option("--distances", o.depth.distances,
                         "Nearest and farthest distance of relative depth maps (1 and 0)")
            ->expected(2)
            ->type_name("NEAR FAR");
        command
            ->add_option("--fov", o.depth.fov_degrees,
                         "Degrees across the width; default: by intrinsics.txt of the data set")
            ->type_name("DEG");
    }
    add_count_option(*command, "--batch", o.batch, "Pictures in memory at a time", 1, 1024);
    add_shard_option(*command, o.shard, "the pictures");
    add_threads_option(*command, o.threads);
    add_overwrite_flag(*command, o.overwrite, "Maps in DIR");
    add_json_flag(*command, *json);
    command->callback([command, options, json, &exit_code] {
        for (const char* name : {"--runtime", "--tokens", "--device"})
            if (const CLI::Option* given = command->get_option_no_throw(name);
                given != nullptr && given->count() > 0)
                options->of_models.emplace_back(name);
        exit_code = run_priors(*options, *json);
    });
}

}  // namespace

void add_priors_make(CLI::App& priors, int& exit_code) {
    for (const MapText& text : kMapTexts) add_map(priors, text, exit_code);
}

}  // namespace vkrun
