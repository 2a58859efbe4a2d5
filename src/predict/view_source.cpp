#include "predict/view_source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <numeric>

#include "core/os/path.h"
#include "data/depth_range.h"
#include "data/planes/plane_channels.h"
#include "predict/head_depths.h"
#include "predict/lgm_views.h"
#include "scene/camera_pose.h"

namespace splat::predict {
namespace {

std::uint32_t maps_of(const config::ModelConfig& network) {
    using data::MapKind;
    const bool depth = network.depth || network.positions == kHeadInputDepth;
    return (depth ? data::flag_of(MapKind::kDepth) : 0) |
           (network.normal ? data::flag_of(MapKind::kNormal) : 0) |
           (network.mask ? data::flag_of(MapKind::kMask) : 0) |
           (network.plane ? data::flag_of(MapKind::kPlane) : 0);
}

bool has_plane_loss(const config::Settings& settings) {
    return settings.training.weighs(&config::TrainConfig::plane_weight);
}

std::uint32_t maps_of(const config::Settings& settings) {
    return maps_of(settings.network) |
           (has_plane_loss(settings) ? data::flag_of(data::MapKind::kPlane) : 0);
}

/// Channels of an input image besides RGB, of all views that are read.
struct Maps {
    std::vector<float> depths, normals, masks, distances;
    std::vector<float> planes;  ///< the input views' alone

    Maps(const config::ModelConfig& network, std::size_t views, std::size_t pixels)
        : depths((maps_of(network) & data::flag_of(data::MapKind::kDepth)) != 0 ? views * pixels
                                                                                : 0),
          normals(network.normal ? views * 3 * pixels : 0),
          masks(network.mask ? views * pixels : 0),
          distances(views) {}
};

void append_input(const config::ModelConfig& network, const Maps& maps, std::size_t view,
                  std::size_t pixels, Views& views) {
    const auto append = [&](const std::vector<float>& planes, std::size_t count) {
        const auto from = planes.begin() + static_cast<std::ptrdiff_t>(view * count * pixels);
        views.inputs.insert(views.inputs.end(), from,
                            from + static_cast<std::ptrdiff_t>(count * pixels));
    };
    if (network.network == config::Network::kLgmUnet) {
        append_lgm_planes(network, std::span(views.images).subspan(view * 3 * pixels, 3 * pixels),
                          std::span(views.view_to_world).subspan(16 * view, 16), views.inputs);
        return;
    }
    append(views.images, 3);
    if (network.depth) append(maps.depths, 1);
    if (network.normal) append(maps.normals, 3);
    if (network.mask) append(maps.masks, 1);
    if (network.plane) append(maps.planes, data::kPlaneChannels);
    if (network.origin_distance)
        views.inputs.insert(views.inputs.end(), pixels, maps.distances[view]);
    if (network.positions != kHeadInputDepth) return;
    append(maps.depths, 1);
    // Larger is nearer in every data set; model.head.depth_maps is of pictures.
    to_scene_depths(network, false, std::span(views.inputs).last(pixels));
}

scene::Camera camera_of(const Views& views, std::size_t view, std::uint32_t resolution) {
    scene::Camera camera;
    camera.name = format("view %zu", view);
    camera.width = camera.height = resolution;
    camera.fx = static_cast<double>(views.focals[2 * view]);
    camera.fy = static_cast<double>(views.focals[2 * view + 1]);
    camera.cx = camera.cy = resolution / 2.0;
    camera.world_to_camera = inverse_pose(views.view_to_world.data() + 16 * view);
    return camera;
}

/// The vectors of a file: as the path says, or in the folder of the data.
Result<data::ViewVectors> vectors_of(const char* key, const std::string& file,
                                     const std::string& root, const char* asked_by,
                                     std::vector<std::int64_t> shape,
                                     const data::DatasetIndex& index) {
    namespace fs = std::filesystem;
    if (file.empty())
        return invalid("'%s' is empty, expected the file of the vectors that '%s' asks for", key,
                       asked_by);
    const fs::path beside = os::path_of(root) / file;
    std::error_code none;
    const bool in_folder =
        !root.empty() && !fs::exists(os::path_of(file), none) && fs::exists(beside, none);
    return data::ViewVectors::load(in_folder ? os::text_of(beside) : file, std::move(shape), index,
                                   key);
}

}  // namespace

scene::Mat4 inverse_pose(const float* view_to_world) {
    // GLM reads the matrix for row vectors as that for column vectors.
    const glm::dmat4 columns = glm::make_mat4(view_to_world);
    return scene::inverse_of_rigid(scene::make_pose(scene::Mat3(columns), scene::Vec3(columns[3])));
}

config::Settings without_map_losses(config::Settings settings) {
    settings.training.plane_weight = 0;
    for (config::TrainConfig& stage : settings.training.stages) stage.plane_weight = 0;
    return settings;
}

std::array<float, 3> background_of(const config::Settings& settings) {
    const float value = settings.training.white_background ? 1.0F : 0.0F;
    return {value, value, value};
}

ViewSource::ViewSource(const config::Settings& settings, std::shared_ptr<data::Dataset> dataset)
    : network_(settings.network),
      gives_planes_(has_plane_loss(settings)),
      dataset_(std::move(dataset)) {}

Result<std::shared_ptr<data::Dataset>> ViewSource::open_split(const config::Settings& settings,
                                                              const std::string& root,
                                                              const std::string& split,
                                                              bool* lacks_split) {
    const config::TrainConfig& training = settings.training;
    data::DatasetDesc desc;
    desc.path = root.empty() ? training.root : root;
    if (desc.path.empty()) return invalid("no data: 'data.root' is empty, expected a folder");
    desc.format = training.format;
    desc.category = training.category;
    desc.split = split;
    desc.objects_file = training.objects_file;
    desc.excluded_file = training.excluded_file;
    desc.views_file = training.views_file;
    desc.maps = maps_of(settings);
    desc.resolution = settings.network.resolution;
    desc.limit = training.subset;
    desc.allow_missing = training.allow_missing;
    desc.cache_bytes = training.cache_mib << 20U;
    desc.background = background_of(settings);
    desc.lacks_split = lacks_split;
    SPLAT_ASSIGN(std::shared_ptr<data::Dataset> dataset, data::Dataset::open(desc));
    return dataset;
}

Result<std::unique_ptr<ViewSource>> ViewSource::open(const config::Settings& settings,
                                                     const std::string& root,
                                                     const std::string& split) {
    SPLAT_ASSIGN(std::shared_ptr<data::Dataset> dataset, open_split(settings, root, split));
    return make(settings, std::move(dataset), root.empty() ? settings.training.root : root);
}

Result<std::unique_ptr<ViewSource>> ViewSource::open(const config::Settings& settings,
                                                     std::shared_ptr<data::Dataset> dataset) {
    if (dataset->resolution() != settings.network.resolution)
        return invalid(
            "the data set was opened at %u x %u pixels, expected %u of "
            "'data.training_resolution'",
            dataset->resolution(), dataset->resolution(), settings.network.resolution);
    const std::array<float, 3> expected = background_of(settings);
    if (dataset->background() != expected)
        return invalid(
            "the data set was opened with another background, expected %s of "
            "'data.white_background'",
            expected[0] > 0 ? "white" : "black");
    const std::uint32_t wanted = maps_of(settings);
    const std::string remedy = dataset->index().plane_remedy();
    for (const data::MapKind map : data::kMaps)
        if ((wanted & ~dataset->index().maps & data::flag_of(map)) != 0)
            return invalid(
                "the data set has no %s maps for every object, which the configuration's %s "
                "takes%s",
                data::map_name(map),
                (maps_of(settings.network) & data::flag_of(map)) != 0 ? "network"
                                                                      : "opt.lambda_plane",
                map == data::MapKind::kPlane && !remedy.empty() ? (": " + remedy).c_str() : "");
    return make(settings, std::move(dataset), settings.training.root);
}

Result<std::unique_ptr<ViewSource>> ViewSource::make(const config::Settings& settings,
                                                     std::shared_ptr<data::Dataset> dataset,
                                                     const std::string& root) {
    const config::ModelConfig& network = settings.network;
    std::unique_ptr<ViewSource> made(new ViewSource(settings, std::move(dataset)));
    const data::DatasetIndex& index = made->dataset_->index();
    if (network.embedding == config::Embedding::kCustom)
        SPLAT_SET(made->embedding_,
                  vectors_of("data.embedding_file", settings.training.embedding_file, root,
                             "data.custom_embedding", {network.embedding_length()}, index));
    if (network.token_dim > 0)
        SPLAT_SET(made->tokens_,
                  vectors_of("data.tokens_file", settings.training.tokens_file, root,
                             "model.tokens", {network.token_dim, network.tokens}, index));
    return made;
}

Result<std::string> ViewSource::field_of_view_warning(std::uint32_t objects) const {
    const auto expected = static_cast<double>(network_.fov_degrees);
    double least = 180, most = 0;
    for (std::uint32_t object = 0; expected > 0 && object < objects;
         object += data::check_stride(objects)) {
        std::vector<std::uint32_t> numbers(views_of(object));
        std::iota(numbers.begin(), numbers.end(), 0U);
        std::vector<float> focals(2 * numbers.size());
        data::ViewArrays arrays;
        arrays.focals = focals.data();
        SPLAT_TRY(dataset_->read(object, numbers, arrays));
        for (const float focal : focals) {
            const double half = std::atan(resolution() / (2 * static_cast<double>(focal)));
            const double fov = 2 * half * 180 / std::numbers::pi;
            least = std::min(least, fov);
            most = std::max(most, fov);
        }
    }
    if (least >= 0.99 * expected && most <= 1.01 * expected) return std::string();
    const bool one = most - least < 0.01 * most;
    const std::string found =
        one ? format("is %.4g", most) : format("is %.4g to %.4g", least, most);
    return format(
        "the data's field of view %s degrees, but 'data.fov' is %.4g: the network's rays are not "
        "those of the images; %sdata.fov 0 gives each view its own",
        found.c_str(), expected, one ? "give that of the data; " : "");
}

Result<std::string> ViewSource::depth_range_warning() const {
    return data::depth_range_warning(dataset_->reader(), static_cast<double>(network_.znear),
                                     static_cast<double>(network_.zfar));
}

Result<Views> ViewSource::read(std::uint32_t object, std::span<const std::uint32_t> numbers,
                               std::uint32_t inputs, bool levels) const {
    const std::size_t n = numbers.size();
    const std::size_t pixels = std::size_t{resolution()} * resolution();
    Views views;
    views.images.resize(levels ? 0 : n * 3 * pixels);
    views.levels.resize(levels ? n * 3 * pixels : 0);
    views.view_to_world.resize(16 * n);
    views.quaternions.resize(4 * n);
    views.focals.resize(2 * n);
    Maps maps(network_, n, pixels);
    const auto wanted = [](auto& values) { return values.empty() ? nullptr : values.data(); };
    SPLAT_TRY(
        dataset_->read(object, numbers,
                       {wanted(views.images), wanted(maps.depths), wanted(maps.normals),
                        wanted(maps.masks), views.view_to_world.data(), views.quaternions.data(),
                        views.focals.data(), maps.distances.data(), wanted(views.levels)}));
    const auto seen = numbers.first(inputs);
    if (network_.plane || gives_planes_) {
        maps.planes.resize(inputs * data::kPlaneChannels * pixels);
        SPLAT_TRY(dataset_->read_planes(object, seen, maps.planes.data()));
    }
    if (network_.network == config::Network::kLgmUnet) move_origin(network_, views);
    for (std::size_t i = 0; levels && i < inputs * 3 * pixels; ++i)
        views.images.push_back(static_cast<float>(views.levels[i]) / 255.0F);
    for (std::size_t i = 0; i < inputs; ++i) append_input(network_, maps, i, pixels, views);
    for (std::size_t i = 0; i < n; ++i) views.cameras.push_back(camera_of(views, i, resolution()));
    if (gives_planes_) views.planes = std::move(maps.planes);
    if (embedding_) embedding_->append(object, seen, views.embedding);
    if (tokens_) tokens_->append(object, seen, views.tokens);
    return views;
}

}  // namespace splat::predict
