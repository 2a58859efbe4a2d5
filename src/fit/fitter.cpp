#include "fit/fitter.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/rng.h"
#include "core/stopwatch.h"
#include "fit/growth.h"

namespace splat::fit {
namespace {

constexpr double kSsimWeight = 0.2;

/// Canvases that are kept: photographs of many sizes make them anew.
constexpr std::size_t kMostCanvases = 3;

PhotoLossDesc loss_of(std::uint32_t width, std::uint32_t height) {
    return {.width = width, .height = height, .ssim_weight = kSsimWeight};
}

}  // namespace

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
    return std::uint64_t{16} * width * height * kStepViews <= most ? kStepViews : 1;
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

Status Fitter::load(const io::NamedTensors& state, std::uint64_t grown) {
    SPLAT_TRY(set_.load(state));
    grown_ = grown;
    return {};
}

Status Fitter::save(io::NamedTensors& state) {
    SPLAT_TRY(usable());
    return set_.save(state);
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

Result<Fitter::Canvas*> Fitter::canvas(std::uint32_t width, std::uint32_t height, bool grows) {
    if (grows != canvases_grow_) canvases_.clear();
    canvases_grow_ = grows;
    const std::pair size(width, height);
    if (const auto found = canvases_.find(size); found != canvases_.end()) return &found->second;
    if (canvases_.size() >= kMostCanvases) canvases_.clear();
    raster::RasterDesc desc;
    static_cast<gaussians::SetDesc&>(desc) = set_.desc();
    desc.width = width;
    desc.height = height;
    desc.views = views_at_once(width, height);
    desc.convention = raster::Convention::kGsplat;
    desc.near_plane = static_cast<float>(near_plane_);
    desc.backward = true;
    desc.export_gradients = grows;
    Canvas made;
    SPLAT_ASSIGN(made.rasterizer, raster::Rasterizer::create(context_, desc));
    const auto make = [&](std::uint64_t bytes) {
        return context_.memory().allocate(bytes, vk::MemoryKind::kDevice, "loss of a fit");
    };
    const PhotoLossDesc loss = loss_of(width, height);
    const vk::Recorder recorder(context_);
    SPLAT_ASSIGN(made.grad_image, make(desc.pixels() * 16));
    SPLAT_ASSIGN(made.workspace, make(photo_loss_workspace(recorder, loss)));
    for (std::uint32_t view = 0; view < desc.views; ++view) {
        SPLAT_ASSIGN(vk::Buffer sums, make(photo_loss_partial(recorder, loss)));
        made.sums.push_back(std::move(sums));
    }
    return &canvases_.emplace(size, std::move(made)).first->second;
}

std::size_t Fitter::view_of(std::uint64_t turn) {
    // A permutation of the views for each round, drawn by the seed (Fisher and Yates).
    const std::size_t count = photos_.size();
    const std::uint64_t round = turn / count;
    if (order_.empty() || round != round_) {
        order_.resize(count);
        std::iota(order_.begin(), order_.end(), std::size_t{0});
        for (std::size_t i = count; i > 1; --i) {
            const auto word = philox(
                {static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(round), 0, 0},
                {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)});
            std::swap(order_[i - 1], order_[((std::uint64_t{word[0]} << 32) | word[1]) % i]);
        }
        round_ = round;
    }
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
    const std::vector<Row> rows = grown_rows(scores, schedule_.wanted(fraction));
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
        SPLAT_TRY(photo_loss(recorder, desc,
                             {.image = canvas.rasterizer->workspace().image.range(),
                              .truth = views[i]->pixels,
                              .workspace = canvas.workspace.range(),
                              .grad_image = canvas.grad_image.range(),
                              .partial = canvas.sums[i].range()},
                             views[i]->valid, share));
    }
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    SPLAT_TRY(context_.run(list));
    std::vector<float> sums(canvas.sums[0].bytes() / sizeof(float));
    for (std::size_t i = 0; i < views.size(); ++i) {
        SPLAT_TRY(context_.read(canvas.sums[i].range(), sums.data(), sums.size() * sizeof(float)));
        const PhotoLossSums sum = photo_loss_sums(sums);
        const double samples = 3.0 * std::max(views[i]->valid, 1U);
        done.l1 += share * sum.absolute / samples;
        done.ssim += share * (1 - sum.dissimilarity / samples);
        done.squared += share * sum.squared_error(views[i]->valid);
        done.loss += share * sum.loss(desc, views[i]->valid);
    }
    return {};
}

Status Fitter::draw_and_compare(const Views& views, std::uint32_t degree, Canvas& canvas,
                                FitStep& done) {
    const Stopwatch drawing;
    raster::Rasterizer& rasterizer = *canvas.rasterizer;
    std::vector<scene::Camera> cameras;
    for (const Truth* const view : views) cameras.push_back(view->camera);
    SPLAT_ASSIGN(const raster::PackedViews packed,
                 raster::pack_views(rasterizer.desc(), cameras, background_));
    SPLAT_TRY(rasterizer.forward(set_.drawn(degree), packed));
    done.drawn = rasterizer.stats();
    const double drawn = drawing.seconds();
    SPLAT_TRY(compare(views, canvas, done));
    done.loss_seconds = drawing.seconds() - drawn;
    if (std::isfinite(done.loss))
        SPLAT_TRY(rasterizer.backward(canvas.grad_image.range(), no_depth_.range(),
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
    const bool grows = schedule_.splits_after(step);
    SPLAT_ASSIGN(Canvas* const to, canvas(views[0]->camera.width, views[0]->camera.height, grows));
    SPLAT_TRY(draw_and_compare(views, plan.degree, *to, done));
    done.skipped = !std::isfinite(done.loss);
    if (done.skipped) return {};
    const Stopwatch updating;
    const Rates rates = schedule_.rates(static_cast<double>(plan.fraction));
    const std::uint32_t summed = grows ? static_cast<std::uint32_t>(views.size()) : 0;
    SPLAT_TRY(run_whole([&](vk::Recorder& recorder) {
        return set_.update(recorder, rates, step + 1, plan.degree,
                           to->rasterizer->workspace().exported.range(), summed);
    }));
    done.update_seconds = updating.seconds();
    return {};
}

Result<std::vector<float>> Fitter::draw(const scene::Camera& camera, std::uint32_t sh_degree) {
    SPLAT_TRY(usable());
    SPLAT_TRY(check_size(camera.width, camera.height));
    SPLAT_ASSIGN(Canvas* const to, canvas(camera.width, camera.height, canvases_grow_));
    SPLAT_ASSIGN(const raster::PackedViews views,
                 raster::pack_views(to->rasterizer->desc(), {&camera, 1}, background_));
    SPLAT_TRY(to->rasterizer->forward(set_.drawn(sh_degree), views));
    const std::size_t pixels = std::size_t{camera.width} * camera.height;
    std::vector<float> quads(4 * pixels), image(3 * pixels);
    SPLAT_TRY(context_.read(to->rasterizer->workspace().image.range(), quads.data(),
                            quads.size() * sizeof(float)));
    for (std::size_t i = 0; i < image.size(); ++i) image[i] = quads[4 * (i % pixels) + i / pixels];
    return image;
}

Result<double> Fitter::slowness() {
    constexpr std::uint64_t kTimed = 3;
    std::vector<double> ratios;
    for (const std::uint32_t factor : {4U, 2U, 1U}) {
        SPLAT_TRY(use_size(factor));
        for (std::uint64_t turn = 0; turn <= kTimed; ++turn) {
            const Views views = views_of(*truths_, turn);
            const scene::Camera& camera = views[0]->camera;
            SPLAT_ASSIGN(Canvas* const to, canvas(camera.width, camera.height, true));
            const Stopwatch watch;
            FitStep done;
            SPLAT_TRY(draw_and_compare(views, 0, *to, done));
            const double model = step_milliseconds(
                set_.count(), 0, static_cast<double>(camera.width) * camera.height);
            // The first turn compiles kernels and finds the memory for pairs.
            if (turn > 0) ratios.push_back(1000 * watch.seconds() / model);
        }
    }
    std::sort(ratios.begin(), ratios.end());
    return ratios[ratios.size() / 2];
}

}  // namespace splat::fit
