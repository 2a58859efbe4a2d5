// Aggregation at inference, as the program of F3D-Gaus has it (W-Ted/F3D-Gaus 8e52aec): what is predicted of a picture
// is drawn from further views, each of these is predicted again by itself, and all Gaussians are joined.
#include <cmath>
#include <numbers>

#include "data/relative_pose.h"
#include "predict/drawn_views.h"
#include "predict/predictor.h"
#include "scene/camera_pose.h"

namespace splat::predict {
namespace {

/// Greatest angles of the published orbit, radians.
constexpr double kYaw = 0.25, kPitch = 0.15;

/// Add Gaussians of the same degree behind those of a scene.
void join(gaussians::Downloaded& to, const gaussians::Downloaded& more) {
    const auto append = [](std::vector<float>& all, const std::vector<float>& each) {
        all.insert(all.end(), each.begin(), each.end());
    };
    append(to.gaussians.means, more.gaussians.means);
    append(to.gaussians.log_scales, more.gaussians.log_scales);
    append(to.gaussians.rotations, more.gaussians.rotations);
    append(to.gaussians.opacity_logits, more.gaussians.opacity_logits);
    append(to.gaussians.sh, more.gaussians.sh);
    to.not_finite += more.not_finite;
    to.faint += more.faint;
}

}  // namespace

Status check_aggregation(const config::ModelConfig& network, std::uint32_t views) {
    if (views == 0) return {};
    if (views == 1 || views > kMostAggregated)
        return invalid("aggregation over %u views, expected 0, or 2 to %u", views, kMostAggregated);
    if (takes_drawn_views(network)) return {};
    return invalid(
        "aggregation over %u views: the network must take one picture of colours and mask, and "
        "depths for its head, as that of F3D-Gaus does; drawn views have these",
        views);
}

Result<std::vector<scene::Camera>> orbit_of_aggregation(const config::ModelConfig& network,
                                                        std::uint32_t views) {
    const auto radius = static_cast<double>(network.znear + network.zfar) / 2;
    SPLAT_ASSIGN(
        scene::Camera camera,
        scene::camera_from_fov(network.resolution, network.resolution,
                               static_cast<double>(network.fov_degrees) * std::numbers::pi / 180));
    std::vector<scene::Camera> cameras;
    for (std::uint32_t i = 0; i < views; ++i) {
        const double turn = 2 * std::numbers::pi * i / (views - 1);
        const double yaw = -kYaw * std::sin(turn), pitch = kPitch * std::cos(turn);
        const scene::Vec3 target(0, 0, radius);
        const scene::Vec3 from(std::sin(yaw) * std::cos(pitch), std::sin(pitch),
                               std::cos(yaw) * std::cos(pitch));
        SPLAT_ASSIGN(camera.world_to_camera,
                     scene::look_at(target - radius * from, target, scene::kUp));
        cameras.push_back(camera);
    }
    return cameras;
}

Result<gaussians::Downloaded> Predictor::aggregate(const Views& views, const Aggregation& options) {
    const std::uint32_t count = options.views;
    SPLAT_TRY(check_aggregation(config(), count));
    SPLAT_TRY(predict(views));
    if (ledger().outputs_not_finite > 0) return gaussians::Downloaded();
    SPLAT_ASSIGN(gaussians::Downloaded all, scene());
    SPLAT_ASSIGN(const std::vector<scene::Camera> cameras, orbit_of_aggregation(config(), count));
    SPLAT_ASSIGN(
        const auto rasterizer,
        raster::Rasterizer::create(context_, drawn_views_desc(model_->set_desc(), count,
                                                              resolution(), options.convention)));
    SPLAT_ASSIGN(const DrawnViews drawn, draw_views(context_, *rasterizer, model_->set(0), cameras,
                                                    background_, config().zfar));
    std::vector<scene::Mat4> poses = {scene::kNoPose};
    for (const scene::Camera& camera : cameras)
        poses.push_back(scene::inverse_of_rigid(camera.world_to_camera));
    SPLAT_ASSIGN(const std::vector<data::RelativeView> relative, data::relative_views(poses));
    for (std::size_t i = 0; i < count; ++i) {
        Views seen;
        drawn.append_planes(i, seen.inputs);
        const data::RelativeView& pose = relative[i + 1];
        seen.view_to_world.assign(pose.view_to_world.begin(), pose.view_to_world.end());
        seen.quaternions.assign(pose.quaternion.begin(), pose.quaternion.end());
        seen.embedding = views.embedding;
        seen.tokens = views.tokens;
        SPLAT_TRY(predict(seen));
        if (ledger().outputs_not_finite > 0) return gaussians::Downloaded();
        SPLAT_ASSIGN(const gaussians::Downloaded more, scene());
        join(all, more);
    }
    return all;
}

}  // namespace splat::predict
