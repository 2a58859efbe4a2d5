// Cycle training, as libsplat defines it: F3D-Gaus, after which it is named, publishes neither code nor terms. In each
// opt.cycle.every-th step Gaussians are predicted of the batch and drawn as its last target sees them, with alpha and
// depth. The network predicts again from that drawing, through which no gradient passes. Both sets of Gaussians,
// the first without gradient, are joined and compared with all targets, of which the first is the input view.
#include "data/relative_pose.h"
#include "predict/drawn_views.h"
#include "scene/camera_pose.h"
#include "train/trainer.h"

namespace splat::train {

struct Trainer::CycleInputs {
    std::vector<float> images, view_to_world, quaternions;  ///< parts of a TrainBatch
};

Status Trainer::check_cycle(const model::ModelConfig& network) const {
    if (config_.cycle_every == 0) return {};
    const auto refuse = [&](const char* why) {
        return invalid("'opt.cycle.every' is %llu, but %s: expected 0", llu(config_.cycle_every),
                       why);
    };
    if (!predict::takes_drawn_views(network))
        return refuse(
            "the network does not take one picture of colours and mask, and depths for its head "
            "(model.head f3d, data.use_mask true), which drawn views have");
    if (config_.scale_terms) return refuse("opt.scale_terms is true");
    if (config_.target_resolution != 0) return refuse("opt.target_resolution is not 0");
    if (config_.weighs(&config::TrainConfig::plane_weight))
        return refuse("opt.lambda_plane is not 0, and drawn views have no planes");
    if (config_.targets < 2) return refuse("opt.imgs_per_obj is 1, the input view alone");
    return {};
}

Status Trainer::build_cycle(const raster::RasterDesc& object) {
    if (config_.cycle_every == 0) return {};
    SPLAT_SET(drawer_, raster::Rasterizer::create(
                           context_, predict::drawn_views_desc(object, 1, object.width,
                                                               raster::Convention::k3dgs)));
    gaussians::SetDesc all = model_->set_desc();
    all.gaussians *= objects_;
    SPLAT_ASSIGN(detached_, gaussians::allocate_set(context_, all));
    const std::uint32_t each = object.gaussians;
    for (std::uint32_t i = 0; i < objects_; ++i) {
        const auto kept = gaussians::part(all, detached_.views(), i * each, each);
        SPLAT_ASSIGN(vk::CommandList keep,
                     copy_of_set(context_, model_->set(i % config_.micro_batch), kept));
        SPLAT_ASSIGN(
            vk::CommandList join,
            copy_of_set(context_, kept, gaussians::part(scene_.desc, scene_.views(), each, each)));
        keep_.push_back(std::move(keep));
        join_.push_back(std::move(join));
    }
    return {};
}

bool Trainer::cycles_now() const {
    const std::uint64_t done = attempts_, after = config_.cycle_after;
    return config_.cycle_every > 0 && done >= after &&
           (done - after + 1) % config_.cycle_every == 0;
}

Status Trainer::draw_cycle(const TrainBatch& batch, CycleInputs& made, TrainStep& result) {
    const std::array<float, 3> background =
        config_.white_background ? std::array<float, 3>{1, 1, 1} : std::array<float, 3>{};
    for (std::uint32_t object = 0; object < objects_; ++object) {
        if (object % config_.micro_batch == 0) {
            SPLAT_TRY(set_input(batch, object, result));
            SPLAT_TRY(model_->forward_unread());
        }
        context_.charge = &result.render_seconds;
        const scene::Camera& camera = batch.cameras[(object + 1) * config_.targets - 1];
        SPLAT_ASSIGN(
            const predict::DrawnViews drawn,
            predict::draw_views(context_, *drawer_, model_->set(object % config_.micro_batch),
                                {&camera, 1}, background, model_->config().zfar));
        drawn.append_planes(0, made.images);
        SPLAT_TRY(context_.run(keep_[object]));
        const scene::Mat4 poses[] = {scene::kNoPose,
                                     scene::inverse_of_rigid(camera.world_to_camera)};
        SPLAT_ASSIGN(const std::vector<data::RelativeView> relative, data::relative_views(poses));
        made.view_to_world.insert(made.view_to_world.end(), relative[1].view_to_world.begin(),
                                  relative[1].view_to_world.end());
        made.quaternions.insert(made.quaternions.end(), relative[1].quaternion.begin(),
                                relative[1].quaternion.end());
    }
    return {};
}

Status Trainer::attempt_cycle(const TrainBatch& batch, Unread& made, bool read_it) {
    CycleInputs inputs;
    SPLAT_TRY(agreed(draw_cycle(batch, inputs, made.step)));
    TrainBatch again = batch;
    again.images = inputs.images;
    again.view_to_world = inputs.view_to_world;
    again.quaternions = inputs.quaternions;
    cycling_ = true;
    Status done = attempt(again, made, read_it);
    cycling_ = false;
    return done;
}

}  // namespace splat::train
