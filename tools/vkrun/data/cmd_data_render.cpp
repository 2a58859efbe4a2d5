// vkrun data render: meshes drawn as a data set.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <numbers>
#include <set>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/progress.h"
#include "vkrun/cli/shard.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/text.h"
#include "vkrun/data/mesh_list.h"
#include "vkrun/data/transfer.h"

namespace vkrun {
namespace {

constexpr const char* kDataRenderFooter =
    R"(MESHES are .obj (with .mtl and textures), .glb and .gltf files, or folders of them. An object has the name of its
file, or of its folder where the file is model.obj, model_normalized.obj or scene.gltf.

Meshes are centred and scaled by --normalise: unit_diagonal, the box's diagonal is 1 (ShapeNet), which fits into every
view of the default cameras; unit_cube, its longest side is 1, and unit_sphere, its farthest vertex is at 1, which take
a greater --distance; as_given. In the data set z is up.

--format srn writes OUT/srn_CLASS/CLASS_{train,val,test}/OBJECT/ with intrinsics.txt, pose/ and rgb/; images writes
OUT/{train,val,test}/OBJECT/ with transforms.json and rgb/; tables writes srn to OUT/renders, and Parquet files in OUT
of it. Maps lie beside rgb/: depth and normals are those of pixels' centres, a mask is the share of the pixel that the
object covers, albedo the picture without light.

points.ply of an object has points on its surface, in the world of its poses. 'vkrun priors points SCENE points.ply
--pose pose/000064.txt' scores a scene that was predicted from view 64 by Chamfer distance and F-score.

For photographs: --background plain or gradient (a random colour for each view, or two), --jitter D (cameras roll and
aim beside the object by up to D degrees, and stand up to D percent nearer or farther), --exposure E (the object is up
to E stops darker or brighter). Poses and maps stay exact.

Existing objects are kept, so an interrupted run can be repeated. Shards write one folder together, from any number of
processes and machines, with the bytes of one. Which meshes there are, --splits and --seed decide the splits. A mesh
that cannot be used is named, and the others are drawn.

Exit status: 0 done, 1 a mesh cannot be used, or a file not written, 2 wrong usage, 3 no device, 4 there are no meshes,
or tables cannot be written.

Examples:
  vkrun data render models --out data
  vkrun data render chair.glb table.obj --out data --splits 1,0,0 --views 100 --size 64
  vkrun data render models --out data --background gradient --jitter 2 --exposure 0.5
  vkrun data render ShapeNetCore.v2/02958343 --out data --class cars --allow-missing --shard 0/8
)";

constexpr double kDegree = std::numbers::pi / 180;

struct RenderDataOptions {
    std::vector<std::string> meshes;
    std::string out;
    std::string format = "srn";
    std::string category = "objects";
    std::string protocol = "sphere";
    std::string normalise = "unit_diagonal";
    std::string up = "y";
    std::string background = "white";
    std::vector<std::string> maps = {"depth", "normal", "mask"};
    std::vector<double> splits = {0.8, 0.1, 0.1};
    std::uint64_t seed = 0;
    std::uint32_t views = 50, test_views = 251, size = 128, samples = 4, points = 10000;
    double distance = 1.3, fov = 0, elevation = 20, jitter = 0, exposure = 0;
    std::string shard, device = "best", duckdb;
    bool lenient = false, json = false;
};

/// The place of a word in a list.
template <class Words>
std::int32_t place_of(const Words& words, const std::string& word) {
    return static_cast<std::int32_t>(std::find(std::begin(words), std::end(words), word) -
                                     std::begin(words));
}

// In the order of the library's numbers.
const std::vector<std::string> kProtocols = {"sphere", "hemisphere", "orbit"};
const std::vector<std::string> kBackgrounds = {"white", "black", "gray", "plain", "gradient"};
const std::vector<std::string> kSizes = {"as_given", "unit_cube", "unit_diagonal", "unit_sphere"};
const std::vector<std::string> kMaps = {"depth", "normal", "mask", "albedo"};

/// What the objects have in common.
splat_mesh_views_desc desc_of(const RenderDataOptions& options, const std::string& path,
                              const std::string& prepared) {
    auto desc = sized<splat_mesh_views_desc>();
    for (const std::string& map : options.maps)
        if (map != "none") desc.flags |= 1U << place_of(kMaps, map);
    if (options.up == "y") desc.flags |= SPLAT_MESH_VIEWS_Y_UP;
    desc.path = path.c_str();
    desc.layout = options.format == "images" ? "images" : "srn";
    desc.category = options.category.c_str();
    desc.prepared = prepared.c_str();
    desc.seed = options.seed;
    desc.size = options.size;
    desc.train_views = options.views;
    desc.test_views = options.test_views;
    desc.samples = options.samples;
    desc.points = options.points;
    desc.protocol = place_of(kProtocols, options.protocol);
    desc.background = place_of(kBackgrounds, options.background);
    desc.distance = options.distance;
    desc.fov_x = options.fov * kDegree;
    desc.elevation = options.elevation * kDegree;
    desc.jitter = options.jitter * kDegree;
    desc.exposure = options.exposure;
    return desc;
}

/// True for an error that is the mesh's, so that others may do.
bool is_of_mesh(splat_result result) {
    const std::set<splat_result> codes = {
        SPLAT_ERROR_FORMAT, SPLAT_ERROR_UNSUPPORTED, SPLAT_ERROR_INVALID_ARGUMENT,
        SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY};
    return codes.count(result) != 0;
}

/// Draws meshes one by one, and keeps a list of what cannot be drawn.
class MeshDrawer {
  public:
    MeshDrawer(const RenderDataOptions& options, const std::string& path)
        : options_(options),
          path_(path),
          prepared_(options.normalise + ", " + options.up + " up"),
          desc_(desc_of(options, path_, prepared_)) {}

    void draw(const MeshFile& file) {
        desc_.name = file.name.c_str();
        desc_.split = file.split.c_str();
        std::int32_t found = 0;
        check(splat_mesh_find_views(&desc_, &found));
        if (found != 0) {
            count(file, kept);
            return;
        }
        Mesh mesh;
        if (!read(file, mesh)) return;
        if (device_.get() == nullptr) device_ = open_device(device_desc(options_.device));
        const splat_result result = splat_mesh_write_views(mesh.get(), device_.get(), &desc_);
        if (!is_of_mesh(result)) {
            check(result);
            count(file, made);
            return;
        }
        refuse(file);
    }

    std::uint32_t made = 0, kept = 0;
    std::uint64_t views = 0;
    std::map<std::string, std::uint32_t> of_split;
    Json refused = Json::array(), warnings = Json::array();

  private:
    void count(const MeshFile& file, std::uint32_t& counter) {
        ++counter;
        ++of_split[file.split];
        views += file.split == "train" ? options_.views : options_.test_views;
    }

    void refuse(const MeshFile& file, const char* advice = "") {
        const std::string problem = about_file(file.path, library_message()) + advice;
        refused.push_back({{"mesh", file.path}, {"problem", problem}});
    }

    bool read(const MeshFile& file, Mesh& mesh) {
        auto desc = sized<splat_mesh_file_desc>();
        if (options_.lenient) desc.flags = SPLAT_MESH_LENIENT;
        const splat_result result = splat_mesh_load(file.path.c_str(), &desc, mesh.out());
        if (result < SPLAT_OK) {
            const bool lacks = result == SPLAT_ERROR_NOT_FOUND && !options_.lenient;
            refuse(file, lacks ? " (--allow-missing leaves out what a mesh names)" : "");
            return false;
        }
        if (splat_mesh_normalise(mesh.get(), place_of(kSizes, options_.normalise)) < SPLAT_OK) {
            refuse(file);
            return false;
        }
        const Json report = library_json(splat_mesh_load_report, mesh.get());
        for (const Json& warning : report.at("warnings"))
            warnings.push_back({{"mesh", file.path}, {"sentence", warning}});
        return true;
    }

    const RenderDataOptions& options_;
    std::string path_, prepared_;
    splat_mesh_views_desc desc_;
    Device device_;
};

void check_options(const CLI::App& command, const RenderDataOptions& options) {
    check_number("--distance", options.distance, 1e-6, 1e6);
    if (options.fov != 0) check_number("--fov", options.fov, 1, 170);
    check_number("--elevation", options.elevation, -89, 89);
    check_number("--jitter", options.jitter, 0, 45);
    check_number("--exposure", options.exposure, 0, 8);
    if ((options.samples & (options.samples - 1)) != 0)
        throw Failure(kUsageError,
                      format("--samples is %u, expected 1, 2, 4 or 8", options.samples));
    double sum = 0;
    for (const double share : options.splits) {
        check_number("a share of --splits", share, 0, 1e9);
        sum += share;
    }
    if (options.splits.size() != 3 || !(sum > 0))
        throw Failure(kUsageError,
                      "--splits takes three shares, of train, val and test, not all 0");
    const auto asked = [&options](const char* map) {
        return std::count(options.maps.begin(), options.maps.end(), map) != 0;
    };
    if (asked("none") && options.maps.size() > 1)
        throw Failure(kUsageError, "--maps none goes with no other map");
    if (options.protocol != "orbit" && command.count("--elevation") != 0)
        throw Failure(kUsageError, "--elevation has no effect without --protocol orbit");
    if (options.format != "tables") {
        if (command.count("--duckdb") != 0)
            throw Failure(kUsageError, "--duckdb has no effect without --format tables");
    } else if (asked("albedo")) {
        throw Failure(kUsageError, "tables have no albedo; it goes with --format srn and images");
    } else if (!options.shard.empty()) {
        throw Failure(kUsageError,
                      "tables are written by one process: draw shards with --format srn, then "
                      "'vkrun data export' makes tables of them");
    }
    if (options.format == "images" && command.count("--class") != 0)
        throw Failure(kUsageError, "--class has no effect with --format images");
}

/// The objects of OUT/renders as tables in OUT.
void write_tables(const RenderDataOptions& options, const std::string& renders,
                  const MeshDrawer& drawn) {
    TransferOptions transfer;
    transfer.source = renders;
    transfer.out = options.out;
    transfer.category = options.category;
    transfer.duckdb = options.duckdb;
    for (const auto& [split, objects] : drawn.of_split)
        write_split(transfer, open_source(transfer, split).get(), split, {});
}

void print_report(const RenderDataOptions& options, const std::string& folder,
                  const MeshDrawer& drawn, double seconds) {
    const std::uint32_t objects = drawn.made + drawn.kept;
    if (options.json) {
        print_json({{"path", folder},
                    {"objects", objects},
                    {"kept", drawn.kept},
                    {"splits", drawn.of_split},
                    {"views", drawn.views},
                    {"resolution", options.size},
                    {"seed", options.seed},
                    {"refused", drawn.refused},
                    {"warnings", drawn.warnings},
                    {"seconds", seconds}});
        return;
    }
    for (const Json& warning : drawn.warnings)
        std::fprintf(stderr, "vkrun: warning: %s\n",
                     about_file(warning.at("mesh").get<std::string>(),
                                warning.at("sentence").get<std::string>())
                         .c_str());
    for (const Json& mesh : drawn.refused)
        std::fprintf(stderr, "vkrun: %s\n", mesh.at("problem").get<std::string>().c_str());
    std::string splits;
    for (const char* split : {"train", "val", "test"})
        if (const auto found = drawn.of_split.find(split); found != drawn.of_split.end())
            splits += format("%s%u %s", splits.empty() ? "" : ", ", found->second, split);
    std::printf("%s: %u objects%s, %llu views of %u x %u pixels, %.1f s\n", folder.c_str(), objects,
                splits.empty() ? "" : (" (" + splits + ")").c_str(),
                static_cast<unsigned long long>(drawn.views), options.size, options.size, seconds);
    if (drawn.kept > 0) std::printf("%u of them were there\n", drawn.kept);
    if (!drawn.refused.empty()) std::printf("%zu meshes cannot be used\n", drawn.refused.size());
}

int render_data(const CLI::App& command, const RenderDataOptions& options) {
    check_options(command, options);
    const Shard shard = parse_shard(options.shard);
    std::vector<MeshFile> meshes = find_meshes(options.meshes);
    deal_meshes(meshes, {options.splits[0], options.splits[1], options.splits[2]}, options.seed);
    const std::string path = options.format == "tables" ? options.out + "/renders" : options.out;
    const Stopwatch watch;
    MeshDrawer drawer(options, path);
    {
        Progress progress("meshes", meshes.size());
        for (std::size_t i = shard.index; i < meshes.size(); i += shard.count) {
            progress.show(i);
            drawer.draw(meshes[i]);
        }
    }
    if (options.format == "tables") write_tables(options, path, drawer);
    const bool in_folder = options.format == "srn";
    print_report(options, in_folder ? options.out + "/srn_" + options.category : options.out,
                 drawer, watch.seconds());
    return drawer.refused.empty() ? kSuccess : kFailed;
}

CLI::Option* add_words(CLI::App& command, const char* name, std::string& value, const char* text,
                       const std::vector<std::string>& words) {
    return command.add_option(name, value, text)
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of(words));
}

void add_number(CLI::App& command, const char* name, double& value, const char* text) {
    command.add_option(name, value, text)->type_name("X")->capture_default_str();
}

void add_camera_options(CLI::App& command, RenderDataOptions& options) {
    add_words(
        command, "--protocol", options.protocol,
        "Where cameras stand: sphere, hemisphere (at random; val and test on\na spiral) or orbit",
        kProtocols);
    add_number(command, "--elevation", options.elevation, "Of an orbit, degrees above the horizon");
    add_number(command, "--distance", options.distance, "Of the cameras from the origin");
    add_number(command, "--fov", options.fov, "Field of view, degrees; 0: SRN's, 52");
}

void add_look_options(CLI::App& command, RenderDataOptions& options) {
    add_count_option(command, "--samples", options.samples,
                     "Samples of a pixel's side: 1, 2, 4 or 8", 1, 8);
    add_words(command, "--background", options.background,
              "white, black, gray, plain (random) or gradient", kBackgrounds);
    add_number(command, "--jitter", options.jitter,
               "Cameras move at random: degrees, and percent of their distance");
    add_number(command, "--exposure", options.exposure,
               "Objects get darker or brighter at random: stops");
}

}  // namespace

void add_data_render(CLI::App& data, int& exit_code) {
    CLI::App* command = add_command(data, "render", "Draw meshes as a data set with exact maps.",
                                    kDataRenderFooter);
    const auto options = std::make_shared<RenderDataOptions>();
    command->add_option("MESHES", options->meshes, "Meshes, or folders of them")
        ->required()
        ->type_name("");
    command->add_option("--out", options->out, "Folder to write to")->required()->type_name("DIR");
    add_words(*command, "--format", options->format, "What to write: srn, tables or images",
              {"srn", "tables", "images"});
    command->add_option("--class", options->category, "Name of the category in names of folders")
        ->type_name("NAME")
        ->capture_default_str();
    add_count_option(*command, "--views", options->views, "Views of each training object", 2,
                     100000);
    add_count_option(*command, "--test-views", options->test_views,
                     "Views of each validation or test object", 2, 100000);
    add_count_option(*command, "--size", options->size, "Side of the images, pixels", 8, 2048);
    command->add_option("--maps", options->maps, "depth, normal, mask, albedo, or none")
        ->type_name("NAME[,NAME]...")
        ->default_str("depth,normal,mask")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(one_of({"depth", "normal", "mask", "albedo", "none"}));
    add_count_option(*command, "--points", options->points,
                     "Points on the surface of each object; 0: none", 0, 10000000);
    add_words(*command, "--normalise", options->normalise,
              "as_given, unit_cube, unit_diagonal or unit_sphere", kSizes);
    add_words(*command, "--up", options->up, "Upward axis of the meshes: y (also glTF's) or z",
              {"y", "z"});
    add_camera_options(*command, *options);
    add_look_options(*command, *options);
    command->add_option("--splits", options->splits, "Shares of train, val and test")
        ->type_name("A,B,C")
        ->default_str("0.8,0.1,0.1")
        ->delimiter(',')
        ->expected(3);
    command->add_option("--seed", options->seed, "Seed of all random choices")
        ->type_name("N")
        ->capture_default_str();
    command->add_flag(
        "--allow-missing", options->lenient,
        "Leave out textures and materials that cannot be read, and name them, instead\nof "
        "refusing the mesh");
    add_shard_option(*command, options->shard, "the meshes");
    command
        ->add_option("--duckdb", options->duckdb,
                     "DuckDB's library, for tables; default: SPLAT_DUCKDB_LIBRARY, or found")
        ->type_name("FILE");
    add_device_option(*command, options->device);
    add_json_flag(*command, options->json);
    command->callback(
        [command, options, &exit_code] { exit_code = render_data(*command, *options); });
}

}  // namespace vkrun
