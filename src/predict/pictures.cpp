#include "predict/pictures.h"

#include <cmath>
#include <numbers>

#include "data/relative_pose.h"
#include "predict/head_depths.h"
#include "predict/lgm_views.h"
#include "scene/camera_pose.h"

namespace splat::predict {
namespace {

Status check_given(std::size_t i, const char* what, bool given, bool wanted) {
    if (given == wanted) return {};
    return invalid("pictures[%zu]: %s, but the network takes %s", i,
                   format(given ? "%s is given" : "%s is missing", what).c_str(),
                   wanted ? "one" : "none");
}

Status check_count(std::size_t i, const char* what, std::size_t count, std::size_t wanted) {
    if (count == wanted) return {};
    return invalid("pictures[%zu]: the %s has %zu numbers, expected %zu of the configuration", i,
                   what, count, wanted);
}

Status check_picture(const config::ModelConfig& network, std::size_t i, const PictureInput& given) {
    SPLAT_TRY(check_given(i, "a depth map", given.picture.depth.has_value(),
                          network.depth || takes_whole_pictures(network)));
    if (takes_whole_pictures(network) && given.crop &&
        given.foreground != PictureInput().foreground)
        return invalid(
            "pictures[%zu]: foreground is %g, but the network takes depths of whole pictures, of "
            "which nothing is cut out: expected none",
            i, given.foreground);
    SPLAT_TRY(check_given(i, "a normal map", given.picture.normal.has_value(), network.normal));
    if (network.plane)
        return invalid(
            "pictures[%zu]: the network takes planes (data.use_pred_plane), which pictures do not "
            "come with; predict an object of a data set instead ('vkrun predict --data'), whose "
            "plane maps 'vkrun priors plane' makes",
            i);
    if (!(given.focal >= 0) || !std::isfinite(given.focal))
        return invalid("pictures[%zu]: the focal length is %g, expected 0 or more", i, given.focal);
    if (network.fov_degrees == 0)
        SPLAT_TRY(check_given(i, "a focal length", given.focal > 0, true));
    const bool distant = given.origin_distance != 0;
    SPLAT_TRY(check_given(i, "an origin distance", distant, network.origin_distance));
    if (distant && !(given.origin_distance > 0 && std::isfinite(given.origin_distance)))
        return invalid("pictures[%zu]: the origin distance is %g, expected more than 0", i,
                       given.origin_distance);
    const bool custom = network.embedding == config::Embedding::kCustom;
    SPLAT_TRY(check_count(i, "embedding", given.embedding.size(),
                          custom ? network.embedding_length() : 0));
    SPLAT_TRY(check_count(i, "array of tokens", given.tokens.size(),
                          std::size_t{network.token_dim} * network.tokens));
    if (network.views == 1 && given.world_to_camera)
        return invalid(
            "pictures[%zu]: a pose is given, but the network takes one view, whose camera "
            "is the scene's frame: expected none",
            i);
    if (network.views == 1) return {};
    const bool around = network.network == config::Network::kLgmUnet;  // has poses of its own
    if (!given.world_to_camera && !around)
        return invalid("pictures[%zu]: no pose, expected one for each of the network's %u views", i,
                       network.views);
    if (given.crop && !takes_whole_pictures(network))
        return invalid(
            "pictures[%zu]: one of %u views is to be cut out, expected whole pictures: "
            "poses belong to these",
            i, network.views);
    return {};
}

/// LGM's network needs several views of one object, all as large, with poses for all or none.
Status check_views(const config::ModelConfig& network, std::span<const PictureInput> pictures) {
    if (network.network != config::Network::kLgmUnet) {
        if (pictures.size() == network.views) return {};
        return invalid("%zu pictures, expected %u: the network takes that many views of an object",
                       pictures.size(), network.views);
    }
    if (pictures.size() != network.views)
        return invalid(
            "%zu picture%s, expected %u: LGM's network takes views of one object from the front, "
            "the right, the back and the left (azimuth 0, 90, 180, 270 degrees, level with it); "
            "make "
            "them from one picture with a multi-view diffusion model such as ImageDream, or render "
            "or photograph the object so",
            pictures.size(), pictures.size() == 1 ? "" : "s", network.views);
    for (std::size_t i = 1; i < pictures.size(); ++i) {
        const io::Image& first = pictures[0].picture.image.image;
        const io::Image& image = pictures[i].picture.image.image;
        if (image.width != first.width || image.height != first.height)
            return invalid(
                "pictures[%zu] has %u x %u pixels, expected %u x %u as pictures[0]: the views of "
                "an "
                "object are seen by one camera",
                i, image.width, image.height, first.width, first.height);
        if (pictures[i].world_to_camera.has_value() != pictures[0].world_to_camera.has_value())
            return invalid("pictures[%zu]: a pose is %s, unlike that of pictures[0]", i,
                           pictures[i].world_to_camera ? "given" : "missing");
    }
    return {};
}

void append(std::vector<float>& to, std::span<const float> from) {
    to.insert(to.end(), from.begin(), from.end());
}

/// Poses and cameras relative to the first view.
Status add_cameras(const config::ModelConfig& network, std::span<const PictureInput> pictures,
                   Views& views) {
    const bool around = network.network == config::Network::kLgmUnet;
    const std::vector<scene::Mat4> own =
        around ? poses_around(network, network.views) : std::vector<scene::Mat4>();
    std::vector<scene::Mat4> poses;
    for (const PictureInput& given : pictures) {
        scene::Camera camera;
        camera.name = format("pictures[%zu]", poses.size());
        camera.width = camera.height = network.resolution;
        camera.fx = static_cast<double>(views.focals[2 * poses.size()]);
        camera.fy = static_cast<double>(views.focals[2 * poses.size() + 1]);
        camera.cx = camera.cy = network.resolution / 2.0;
        if (network.fov_degrees != 0) {
            SPLAT_ASSIGN(const scene::Camera whole,
                         scene::camera_from_fov(
                             network.resolution, network.resolution,
                             static_cast<double>(network.fov_degrees) * std::numbers::pi / 180));
            camera.fx = whole.fx;
            camera.fy = whole.fy;
        }
        camera.world_to_camera =
            given.world_to_camera.value_or(around ? own[poses.size()] : scene::kNoPose);
        SPLAT_TRY(scene::check_camera(camera));
        poses.push_back(scene::inverse_of_rigid(camera.world_to_camera));
        views.cameras.push_back(std::move(camera));
    }
    SPLAT_ASSIGN(const std::vector<data::RelativeView> relative, data::relative_views(poses));
    for (std::size_t i = 0; i < relative.size(); ++i) {
        append(views.view_to_world, relative[i].view_to_world);
        append(views.quaternions, relative[i].quaternion);
    }
    if (around) move_origin(network, views);
    for (std::size_t i = 0; i < relative.size(); ++i)
        views.cameras[i].world_to_camera = inverse_pose(views.view_to_world.data() + 16 * i);
    return {};
}

}  // namespace

PictureFacts facts_of(const data::Photograph& photo, const PictureInput& given) {
    PictureFacts facts{.width = photo.width,
                       .height = photo.height,
                       .whole = !given.crop,
                       .at_border = photo.at_border,
                       .found = photo.mask_from,
                       .x = photo.x,
                       .y = photo.y,
                       .side = photo.side,
                       .focal = given.focal};
    if (given.focal > 0)
        facts.fov_degrees = 2 * std::atan(photo.side / (2 * given.focal)) * 180 / std::numbers::pi;
    return facts;
}

bool takes_whole_pictures(const config::ModelConfig& network) {
    return network.positions == kHeadInputDepth;
}

Result<PictureViews> views_of_pictures(const config::ModelConfig& network,
                                       const std::array<float, 3>& background,
                                       std::span<const PictureInput> pictures) {
    SPLAT_TRY(check_views(network, pictures));
    const bool around = network.network == config::Network::kLgmUnet;
    const std::size_t area = std::size_t{network.resolution} * network.resolution;
    PictureViews made;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        const PictureInput& given = pictures[i];
        SPLAT_TRY(check_picture(network, i, given));
        const bool whole = takes_whole_pictures(network);
        data::CutOptions options{network.resolution, given.crop && !whole, given.foreground,
                                 background};
        options.flood = !whole;
        options.depth = network.depth;
        SPLAT_ASSIGN(const data::Photograph photo, data::cut_photograph(given.picture, options));
        Views& views = made.views;
        append(views.images, photo.image);
        if (!around) append(views.inputs, photo.image);
        if (network.depth) append(views.inputs, photo.depth);
        if (network.normal) append(views.inputs, photo.normal);
        if (network.mask) append(views.inputs, photo.mask);
        if (network.origin_distance)
            views.inputs.insert(views.inputs.end(), area,
                                static_cast<float>(given.origin_distance));
        if (network.positions == kHeadInputDepth) {
            SPLAT_ASSIGN(const std::vector<float> depths,
                         head_depths(network, *given.picture.depth, given.picture.image.image));
            append(views.inputs, depths);
        }
        append(views.embedding, given.embedding);
        append(views.tokens, given.tokens);
        const auto focal = static_cast<float>(given.focal / photo.side * network.resolution);
        views.focals.insert(views.focals.end(), {focal, focal});
        made.facts.push_back(facts_of(photo, given));
        made.facts.back().whole = !options.crop;
    }
    SPLAT_TRY(add_cameras(network, pictures, made.views));
    for (std::size_t i = 0; around && i < pictures.size(); ++i)
        append_lgm_planes(network, std::span(made.views.images).subspan(3 * area * i, 3 * area),
                          std::span(made.views.view_to_world).subspan(16 * i, 16),
                          made.views.inputs);
    return made;
}

bool field_of_view_differs(const config::ModelConfig& network, const PictureFacts& facts) {
    if (network.fov_degrees == 0 || facts.fov_degrees == 0) return false;
    const double ratio = facts.fov_degrees / static_cast<double>(network.fov_degrees);
    return ratio > kFieldOfViewFactor || ratio < 1 / kFieldOfViewFactor;
}

}  // namespace splat::predict
