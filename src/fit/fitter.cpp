#include "fit/fitter.h"

#include <algorithm>
#include <cmath>

#include "core/stopwatch.h"
#include "fit/growth.h"

namespace splat::fit {
namespace {

constexpr double kSsimWeight = 0.2;

/// A step whose views lack more than 1 of so many Gaussians, which are not finite, has diverged.
constexpr std::uint64_t kMostNotFinite = 100;

PhotoLossDesc loss_of(std::uint32_t width, std::uint32_t height) {
    return {.width = width, .height = height, .ssim_weight = kSsimWeight};
}

}  // namespace

Result<std::vector<float>> drawn_image(vk::Context& context, const raster::Rasterizer& rasterizer) {
    const std::size_t pixels = std::size_t{rasterizer.desc().width} * rasterizer.desc().height;
    std::vector<float> quads(4 * pixels), image(3 * pixels);
    SPLAT_TRY(context.read(rasterizer.workspace().image.range(), quads.data(),
                           quads.size() * sizeof(float)));
    for (std::size_t i = 0; i < image.size(); ++i) image[i] = quads[4 * (i % pixels) + i / pixels];
    return image;
}

Result<std::unique_ptr<Fitter>> Fitter::create(vk::Context& context, Desc desc) {
    SPLAT_ASSIGN(FitSet set, FitSet::create(context, desc.schedule.most_gaussians(),
                                            desc.schedule.desc().sh_degree));
    std::unique_ptr<Fitter> made(new Fitter(context, std::move(desc), std::move(set)));
    for (const data::PosedPhoto& photo : made->photos_)
        SPLAT_TRY(made->check_size(photo.width, photo.height));
    SPLAT_ASSIGN(made->no_depth_,
                 context.memory().allocate(16, vk::MemoryKind::kDevice, "gradient of the depth"));
    return made;
}

Status Fitter::check_size(std::uint32_t width, std::uint32_t height) const {
    const vk::Recorder recorder(context_);
    const std::uint64_t most = context_.device().info().limits.max_storage_buffer_bytes;
    const std::uint64_t pixels = std::uint64_t{width} * height;
    const std::uint64_t bytes =
        std::max(16 * pixels, photo_loss_workspace(recorder, loss_of(width, height)));
    if (bytes <= most) return {};
    return unsupported(
        "a photograph of %u x %u pixels, but the device compares at most %llu pixels at once: "
        "divide the photographs' sides by a downscale",
        width, height, llu(pixels * most / bytes));
}

std::uint32_t Fitter::views_at_once(std::uint32_t width, std::uint32_t height) const {
    const std::uint64_t most = context_.device().info().limits.max_storage_buffer_bytes;
    return std::uint64_t{16} * width * height * spared_.views <= most ? spared_.views : 1;
}

Status Fitter::usable() const {
    if (!broken_) return {};
    return bad_state(
        "the device failed while it updated the Gaussians, which are undefined since: close the "
        "run and resume it from its latest state");
}

template <class Record>
Status Fitter::run_whole(const Record& record) {
    vk::Recorder recorder(context_);
    SPLAT_TRY(record(recorder));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    SPLAT_TRY(context_.make_ready(list));
    const vk::Uncancelled whole(context_.mutex);
    broken_ = true;
    SPLAT_TRY(context_.run(list));
    broken_ = false;
    return {};
}

Status Fitter::load(const io::NamedTensors& state, std::uint64_t grown, const Spared& spared) {
    Refinement refined = refinement_;
    SPLAT_TRY(refined.load(state));
    SPLAT_TRY(set_.load(state));
    refinement_ = std::move(refined);
    grown_ = grown;
    set_spared(spared);
    return {};
}

Status Fitter::save(io::NamedTensors& state) {
    SPLAT_TRY(usable());
    SPLAT_TRY(set_.save(state));
    return refinement_.save(state);
}

Status Fitter::use_size(std::uint32_t factor) {
    if (factor == factor_ && truths_) return {};
    truths_.reset();
    canvases_.clear();
    factor_ = factor;
    if (factor == 1) {
        SPLAT_ASSIGN(truths_, Truths::create(context_, photos_));
        return {};
    }
    std::vector<data::PosedPhoto> reduced;
    for (const data::PosedPhoto& photo : photos_)
        reduced.push_back(
            data::reduce(photo, std::min(factor, std::min(photo.width, photo.height))));
    SPLAT_ASSIGN(truths_, Truths::create(context_, reduced));
    return {};
}

Result<Fitter::Canvas*> Fitter::canvas(std::uint32_t width, std::uint32_t height, bool grows,
                                       std::uint32_t factor) {
    // Beside those of other steps there may be no memory for another.
    if (grows != canvases_grow_ || factor != canvases_factor_) canvases_.clear();
    canvases_grow_ = grows;
    canvases_factor_ = factor;
    const std::pair size(width, height);
    if (const auto found = canvases_.find(size); found != canvases_.end()) return &found->second;
    if (canvases_.size() >= kMostCanvases) canvases_.clear();
    raster::RasterDesc desc;
    static_cast<gaussians::SetDesc&>(desc) = set_.desc();
    desc.gaussians = std::min(desc.gaussians, spared_.most_gaussians);
    desc.width = width;
    desc.height = height;
    desc.views = views_at_once(width, height);
    desc.convention = raster::Convention::kGsplat;
    desc.near_plane = static_cast<float>(near_plane_);
    desc.backward = true;
    desc.export_gradients = grows;
    desc.extra = desc.grad_depth = has_priors();
    desc.grad_pose = refinement_.poses();
    Canvas made;
    SPLAT_ASSIGN(made.rasterizer, raster::Rasterizer::create(context_, desc));
    const auto make = [&](std::uint64_t bytes) {
        return context_.memory().allocate(bytes, vk::MemoryKind::kDevice, "loss of a fit");
    };
    PhotoLossDesc loss = loss_of(width, height);
    loss.exposure = refinement_.exposure(0);
    const vk::Recorder recorder(context_);
    SPLAT_ASSIGN(made.grad_image, make(desc.pixels() * 16));
    SPLAT_ASSIGN(made.workspace, make(photo_loss_workspace(recorder, loss)));
    for (std::uint32_t view = 0; view < desc.views; ++view) {
        SPLAT_ASSIGN(vk::Buffer sums, make(photo_loss_partial(recorder, loss)));
        made.sums.push_back(std::move(sums));
    }
    SPLAT_TRY(make_priors(desc, made));
    return &canvases_.emplace(size, std::move(made)).first->second;
}

std::size_t Fitter::view_of(std::uint64_t turn) {
    const std::size_t count = photos_.size();
    const std::uint64_t round = turn / count;
    if (order_.empty() || round != round_) order_ = order_of_round(photos_, seed_, round);
    round_ = round;
    return order_[turn % count];
}

Fitter::Views Fitter::views_of(const Truths& truths, std::uint64_t attempt) {
    Views views;
    for (std::uint64_t i = 0; i < kStepViews; ++i) {
        const Truth& truth = truths.at(view_of(attempt * kStepViews + i));
        const scene::Camera& camera = truth.camera;
        const bool fits =
            views.empty() ||
            (camera.width == views[0]->camera.width && camera.height == views[0]->camera.height &&
             views_at_once(camera.width, camera.height) > views.size());
        if (fits) views.push_back(&truth);
    }
    return views;
}

Status Fitter::grow(std::uint64_t step) {
    if (!schedule_.grows(step) || grown_ == step) return {};
    SPLAT_ASSIGN(const std::vector<Score> scores, set_.scores());
    const auto fraction = static_cast<double>(schedule_.at(step).fraction);
    const std::uint32_t wanted = std::min(schedule_.wanted(fraction), spared_.most_gaussians);
    const std::vector<Row> rows = schedule_.desc().strategy.mcmc
                                      ? relocated_rows(scores, wanted, seed_, step)
                                      : grown_rows(scores, wanted);
    SPLAT_TRY(run_whole([&](vk::Recorder& recorder) { return set_.rearrange(recorder, rows); }));
    set_.rearranged(rows);
    grown_ = step;
    return {};
}

Status Fitter::compare(const Views& views, Canvas& canvas, FitStep& done) {
    PhotoLossDesc desc = loss_of(views[0]->camera.width, views[0]->camera.height);
    const double share = 1 / static_cast<double>(views.size());
    vk::Recorder recorder(context_);
    for (std::size_t i = 0; i < views.size(); ++i) {
        desc.view = static_cast<std::uint32_t>(i);
        desc.exposure = refinement_.exposure(number_of(views[i]));
        SPLAT_TRY(photo_loss(recorder, desc,
                             {.image = canvas.rasterizer->workspace().image.range(),
                              .truth = views[i]->pixels,
                              .workspace = canvas.workspace.range(),
                              .grad_image = canvas.grad_image.range(),
                              .partial = canvas.sums[i].range()},
                             views[i]->valid, share));
    }
    SPLAT_TRY(record_priors(recorder, views, canvas));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    SPLAT_TRY(context_.run(list));
    std::vector<float> sums(canvas.sums[0].bytes() / sizeof(float));
    for (std::size_t i = 0; i < views.size(); ++i) {
        SPLAT_TRY(context_.read(canvas.sums[i].range(), sums.data(), sums.size() * sizeof(float)));
        const PhotoLossSums sum = photo_loss_sums(recorder, desc, sums);
        const double samples = 3.0 * std::max(views[i]->valid, 1U);
        done.l1 += share * sum.absolute / samples;
        done.ssim += share * (1 - sum.dissimilarity / samples);
        done.squared += share * sum.squared_error(views[i]->valid);
        done.loss += share * sum.loss(desc, views[i]->valid);
        if (refinement_.any()) done.refined.push_back({number_of(views[i]), {}, sum.exposure});
    }
    return read_priors(views, canvas, done);
}

Status Fitter::read_refined(const Views& views, const Canvas& canvas, FitStep& done) {
    if (!refinement_.poses()) return {};
    std::vector<float> poses(12 * views.size());
    SPLAT_TRY(context_.read(canvas.rasterizer->workspace().pose.range(), poses.data(),
                            poses.size() * sizeof(float)));
    for (std::size_t i = 0; i < views.size(); ++i)
        std::copy_n(&poses[12 * i], 12, done.refined[i].pose.begin());
    return {};
}

Status Fitter::draw_and_compare(const Views& views, std::uint32_t degree, Canvas& canvas,
                                FitStep& done) {
    const Stopwatch drawing;
    raster::Rasterizer& rasterizer = *canvas.rasterizer;
    std::vector<scene::Camera> cameras;
    for (const Truth* const view : views)
        cameras.push_back(refinement_.camera(number_of(view), view->camera));
    SPLAT_ASSIGN(raster::PackedViews packed,
                 raster::pack_views(rasterizer.desc(), cameras, background_));
    if (schedule_.desc().strategy.skip_tiles && truths_->have_empty_tiles()) {
        std::vector<std::uint8_t> tiles;
        for (const Truth* const view : views)
            tiles.insert(tiles.end(), view->tiles.begin(), view->tiles.end());
        SPLAT_TRY(raster::mask_tiles(rasterizer.desc(), tiles, packed));
    }
    SPLAT_TRY(rasterizer.forward(set_.drawn(degree), packed));
    done.drawn = rasterizer.stats();
    const double drawn = drawing.seconds();
    SPLAT_TRY(compare(views, canvas, done));
    done.loss_seconds = drawing.seconds() - drawn;
    if (std::isfinite(done.loss))
        SPLAT_TRY(rasterizer.backward(canvas.grad_image.range(),
                                      has_priors() ? canvas.grad_depth.range() : no_depth_.range(),
                                      set_.gradients(degree)));
    done.raster_seconds = drawing.seconds() - done.loss_seconds;
    return {};
}

Status Fitter::step(std::uint64_t step, std::uint64_t attempt, FitStep& done) {
    SPLAT_TRY(usable());
    done = {};
    const StepPlan& plan = schedule_.at(step);
    const Stopwatch growing;
    SPLAT_TRY(grow(step));
    done.grow_seconds = growing.seconds();
    SPLAT_TRY(use_size(plan.factor));
    const Views views = views_of(*truths_, attempt);
    prior_decay_ = std::pow(0.01, static_cast<double>(plan.fraction));
    const bool grows = schedule_.splits_after(step);
    SPLAT_ASSIGN(Canvas* const to,
                 canvas(views[0]->camera.width, views[0]->camera.height, grows, factor_));
    SPLAT_TRY(draw_and_compare(views, plan.degree, *to, done));
    const raster::RasterStats& drawn = done.drawn;
    done.skipped =
        !std::isfinite(done.loss) ||
        drawn.non_finite > (drawn.visible + drawn.non_finite + drawn.culled) / kMostNotFinite;
    if (done.skipped) return {};
    const Stopwatch updating;
    Rates rates = schedule_.rates(static_cast<double>(plan.fraction));
    rates.seed = seed_;
    const std::uint32_t summed = grows ? static_cast<std::uint32_t>(views.size()) : 0;
    SPLAT_TRY(read_refined(views, *to, done));
    SPLAT_TRY(run_whole([&](vk::Recorder& recorder) {
        return set_.update(recorder, rates, step + 1, plan.degree,
                           to->rasterizer->workspace().exported.range(), summed);
    }));
    refinement_.update(static_cast<double>(plan.fraction), done.refined);
    done.update_seconds = updating.seconds();
    return {};
}

Result<std::vector<float>> Fitter::draw(const scene::Camera& camera, std::uint32_t sh_degree) {
    SPLAT_TRY(usable());
    SPLAT_TRY(check_size(camera.width, camera.height));
    const auto drawn = [&]() -> Result<std::vector<float>> {
        SPLAT_ASSIGN(Canvas* const to, canvas(camera.width, camera.height, canvases_grow_, 1));
        SPLAT_ASSIGN(const raster::PackedViews views,
                     raster::pack_views(to->rasterizer->desc(), {&camera, 1}, background_));
        SPLAT_TRY(to->rasterizer->forward(set_.drawn(sh_degree), views));
        return drawn_image(context_, *to->rasterizer);
    };
    auto made = drawn();
    if (made.status().code() != Code::kOutOfDeviceMemory) return made;
    // Steps go on with what they had: only this view does with less.
    struct Before {
        Fitter& fitter;
        Spared spared;
        ~Before() { fitter.set_spared(spared); }
    } const before{*this, spared_};
    set_spared({set_.count(), 1});
    return drawn();
}

Result<double> Fitter::slowness() {
    constexpr std::uint64_t kTimed = 3;
    constexpr double kDrawn = 0.92;  // share of drawing and comparing; the rest is the update
    constexpr std::uint32_t kFactors[] = {4, 2, 1};
    double ratios = 0;
    for (const std::uint32_t factor : kFactors) {
        SPLAT_TRY(use_size(factor));
        double milliseconds = 0, model = 0;
        for (std::uint64_t turn = 0; turn <= kTimed; ++turn) {
            const Views views = views_of(*truths_, turn);
            const scene::Camera& camera = views[0]->camera;
            SPLAT_ASSIGN(Canvas* const to, canvas(camera.width, camera.height, true, factor));
            const Stopwatch watch;
            FitStep done;
            SPLAT_TRY(draw_and_compare(views, 0, *to, done));
            if (turn == 0) continue;  // kernels were compiled, and the memory for pairs found
            milliseconds += 1000 * watch.seconds();
            model += step_milliseconds(set_.count(), 0,
                                       static_cast<double>(camera.width) * camera.height);
        }
        ratios += milliseconds / model;
    }
    return ratios / std::size(kFactors) / kDrawn;
}

}  // namespace splat::fit
