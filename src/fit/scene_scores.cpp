#include "fit/scene_scores.h"

#include <algorithm>
#include <cmath>

#include "core/shown.h"
#include "eval/image_scores.h"
#include "fit/fitter.h"
#include "scene/arrays.h"
#include "scene/camera_pose.h"
#include "scene/srgb.h"

namespace splat::fit {
namespace {

/// 1 where a pixel is there and at least `border` of the size away from the edges.
std::vector<std::uint8_t> valid_pixels(const data::PosedPhoto& photo, double border) {
    const auto cut = [border](std::uint32_t size) {
        return static_cast<std::size_t>(std::ceil(border * size - 1e-9));
    };
    const std::size_t left = cut(photo.width), top = cut(photo.height);
    std::vector<std::uint8_t> valid(photo.pixels.size());
    for (std::size_t y = top; y + top < photo.height; ++y)
        for (std::size_t x = left; x + left < photo.width; ++x)
            valid[y * photo.width + x] = photo.pixels[y * photo.width + x] >> 24 == 255 ? 1 : 0;
    return valid;
}

}  // namespace

Result<data::PosedPhotos> load_photos(vk::Context& context, const std::string& folder,
                                      data::PosedPhotosOptions options) {
    // Threads that read photographs hold no mutex, so they compare counts. The holder of one knows of the time before.
    const Interrupt& interrupt = context.mutex.interrupt();
    const std::uint64_t before = interrupt.count();
    SPLAT_TRY(context.mutex.call([] { return Status(); }));
    options.progress = [&](std::size_t, std::size_t) -> Status {
        if (interrupt.count() == before) return {};
        return error(Code::kCancelled, "splat_device_cancel ended the reading of photographs");
    };
    return data::load_posed_photos(folder, options);
}

PhotoFrame center_photos(std::span<data::PosedPhoto> photos) {
    PhotoFrame frame;
    std::vector<scene::Vec3> centers;
    for (const data::PosedPhoto& photo : photos)
        centers.push_back(scene::camera_center(photo.camera));
    for (const scene::Vec3& center : centers)
        frame.center += center / static_cast<double>(centers.size());
    double extent = 0;
    for (const scene::Vec3& center : centers)
        extent = std::max(extent, 1.1 * glm::length(center - frame.center));
    if (extent > 0) frame.extent = extent;
    for (data::PosedPhoto& photo : photos) {
        scene::Mat4& pose = photo.camera.world_to_camera;
        pose =
            scene::make_pose(scene::rotation_of(pose),
                             scene::translation_of(pose) + scene::rotation_of(pose) * frame.center);
    }
    return frame;
}

Status score_photo(const data::PosedPhoto& photo, std::vector<float> drawn, double border,
                   run::Piece& done) {
    for (float& value : drawn) value = std::clamp(value, 0.0F, 1.0F);
    const std::size_t pixels = photo.pixels.size();
    done.images = std::move(drawn);
    done.truths.resize(3 * pixels);
    for (std::size_t i = 0; i < pixels; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            done.truths[c * pixels + i] =
                static_cast<float>(photo.pixels[i] >> (8 * c) & 255U) / 255.0F;
    const auto compare = [&](const std::vector<std::uint8_t>& valid) -> Result<eval::ImageScores> {
        auto found =
            eval::compare_images(done.images, done.truths, 3, photo.height, photo.width, valid);
        if (found.ok()) return found;
        const Status& status = found.status();
        return Status(status.code(),
                      format("'%s': %s", shown(photo.name).c_str(), status.message().c_str()));
    };
    SPLAT_ASSIGN(const eval::ImageScores scores, compare(valid_pixels(photo, 0)));
    done.scores = {{"val_psnr", scores.psnr}, {"val_ssim", scores.ssim}};
    if (border > 0) {
        const std::vector<std::uint8_t> valid = valid_pixels(photo, border);
        eval::ImageScores inner{.psnr = NAN, .ssim = NAN};
        if (std::ranges::find(valid, 1) != valid.end()) SPLAT_SET(inner, compare(valid));
        done.scores.push_back({"inner_psnr", inner.psnr});
        done.scores.push_back({"inner_ssim", inner.ssim});
    }
    done.name = photo.name;
    done.views = 1;
    done.width = photo.width;
    done.height = photo.height;
    return {};
}

run::Numbers mean_scores(std::span<const run::Numbers> views) {
    run::Numbers means = views.empty() ? run::Numbers() : views[0];
    for (std::size_t k = 0; k < means.size(); ++k) {
        double count = 0;
        for (const run::Numbers& view : views) count += std::isnan(view[k].value) ? 0 : 1;
        means[k].value = count > 0 ? 0 : NAN;
        for (const run::Numbers& view : views)
            if (!std::isnan(view[k].value)) means[k].value += view[k].value / count;
    }
    return means;
}

Result<std::unique_ptr<SceneScores>> SceneScores::open(std::shared_ptr<vk::Context> context,
                                                       const SceneScoresDesc& desc,
                                                       scene::Gaussians scene,
                                                       const Interrupt& interrupt) {
    if (!(desc.border >= 0 && desc.border < 0.5))
        return invalid("border is %g, expected 0 to below 0.5", desc.border);
    if (scene.count() == 0) return invalid("the scene has no Gaussians");
    SPLAT_ASSIGN(data::PosedPhotos loaded, load_photos(*context, desc.data, desc.photos));
    std::unique_ptr<SceneScores> made(new SceneScores(std::move(context), desc.border, interrupt));
    const PhotoFrame frame = center_photos(loaded.photos);
    for (data::PosedPhoto& photo : loaded.photos)
        if (photo.held_out || desc.photos.test_every == 0)
            made->photos_.push_back(std::move(photo));
    if (made->photos_.empty())
        return invalid("no photograph of '%s' is held out", desc.data.c_str());
    for (std::string& notice : loaded.notices) made->messages_.push_back({std::move(notice)});
    for (std::size_t i = 0; i < scene.means.size(); ++i)
        scene.means[i] =
            static_cast<float>(static_cast<double>(scene.means[i]) - frame.center[i % 3]);
    if (desc.photos.white_background) made->background_ = {1, 1, 1};
    raster::RasterDesc& raster = made->raster_;
    raster.gaussians = static_cast<std::uint32_t>(scene.count());
    raster.sh_degree = scene.sh_degree;
    raster.convention = raster::Convention::kGsplat;
    raster.near_plane = static_cast<float>(frame.near_plane());
    raster.antialiased = scene.drawn_as.antialiased;
    raster.sort_by_distance = scene.drawn_as.by_distance;
    raster.cut_3_sigma = scene.drawn_as.three_sigma;
    made->linear_colors_ = scene.drawn_as.linear_colors;
    vk::Context& device = *made->context_;
    const std::lock_guard lock(device.mutex);
    SPLAT_TRY(device.mutex.check());
    for (const data::PosedPhoto& photo : made->photos_) {
        raster.width = photo.width;
        raster.height = photo.height;
        SPLAT_TRY(raster::check_desc(device.device().info(), raster));
    }
    SPLAT_ASSIGN(made->device_->set, gaussians::allocate_set(device, raster));
    SPLAT_TRY(gaussians::upload(device, scene, made->device_->set));
    return made;
}

SceneScores::~SceneScores() {
    if (context_->forked())
        device_.release();  // a child of the process owns nothing of the device
    else
        context_->mutex.defer(std::move(device_));
}

Result<std::vector<float>> SceneScores::draw(const scene::Camera& camera) {
    const std::lock_guard lock(context_->mutex);
    SPLAT_TRY(context_->mutex.check());
    auto& rasterizer = device_->rasterizer;
    if (rasterizer == nullptr || rasterizer->desc().width != camera.width ||
        rasterizer->desc().height != camera.height) {
        rasterizer.reset();
        raster_.width = camera.width;
        raster_.height = camera.height;
        SPLAT_ASSIGN(rasterizer, raster::Rasterizer::create(*context_, raster_));
    }
    SPLAT_ASSIGN(const raster::PackedViews views,
                 raster::pack_views(raster_, {&camera, 1}, background_));
    SPLAT_TRY(rasterizer->forward(device_->set.views(), views));
    SPLAT_ASSIGN(std::vector<float> drawn, drawn_image(*context_, *rasterizer));
    if (linear_colors_)
        for (float& value : drawn) value = scene::srgb_of_linear(value);
    return drawn;
}

Status SceneScores::score(run::Event& event) {
    const data::PosedPhoto& photo = photos_[piece_];
    SPLAT_ASSIGN(std::vector<float> drawn, draw(photo.camera));
    SPLAT_TRY(score_photo(photo, std::move(drawn), border_, event.validated));
    event.kind = run::EventKind::kValidatedPiece;
    event.numbers = event.validated.scores;
    event.piece = piece_++;
    scores_.push_back(event.numbers);
    return {};
}

void SceneScores::sum_up(run::Event& event) {
    event.kind = run::EventKind::kValidation;
    event.numbers = mean_scores(scores_);
    psnr_ = event.numbers[0].value;
    ssim_ = event.numbers[1].value;
    event.text = format("held-out PSNR %.3f dB, SSIM %.4f on %zu views, %u Gaussians", psnr_, ssim_,
                        photos_.size(), raster_.gaussians);
    event.numbers.push_back({"val_views", static_cast<double>(photos_.size())});
    event.numbers.push_back({"gaussians", static_cast<double>(raster_.gaussians)});
}

Status SceneScores::next(run::Event& event) {
    event = {};
    event.pieces = static_cast<std::uint32_t>(photos_.size());
    event.peak_bytes = context_->memory().use().peak;
    if (!messages_.empty()) {
        event.text = messages_.front().text;
        messages_.pop_front();
        return {};
    }
    if (!ended_ && interrupt_.count() != raised_before_) ended_ = run::EventKind::kInterrupted;
    if (ended_) {
        event.kind = *ended_;
        return {};
    }
    if (piece_ < photos_.size()) return score(event);
    sum_up(event);
    ended_ = run::EventKind::kDone;
    return {};
}

run::Figures SceneScores::figures() const {
    run::Figures figures;
    figures.validation_psnr = figures.best_validation_psnr = psnr_;
    figures.validation_ssim = ssim_;
    figures.peak_bytes = context_->memory().use().peak;
    return figures;
}

}  // namespace splat::fit
