// What a fit begins with: options, photographs, points, the number of steps, or a state.

#include <algorithm>
#include <cmath>

#include "core/checked_math.h"
#include "core/json_writer.h"
#include "core/number_in.h"
#include "core/shown.h"
#include "fit/fit_task.h"
#include "io/compress.h"
#include "io/file.h"

namespace splat::fit {
namespace {

constexpr double kLongestSeconds = 1e5;    ///< by the cost model, for a number of seconds
constexpr std::uint64_t kValidations = 5;  ///< in a fit
constexpr std::array<float, 3> kWhite = {1, 1, 1};

std::uint32_t sum_of(const data::PosedPhotos& photos) {
    std::uint32_t sum = 0;
    for (const data::PosedPhoto& photo : photos.photos) {
        sum = io::crc32_of(io::as_bytes(photo.name), sum);
        sum = io::crc32_of(std::as_bytes(std::span(photo.pixels)), sum);
        const double lens[] = {photo.camera.fx, photo.camera.fy, photo.camera.cx, photo.camera.cy};
        sum = io::crc32_of(std::as_bytes(std::span(lens)), sum);
        sum = io::crc32_of(std::as_bytes(std::span(photo.camera.world_to_camera)), sum);
        const std::uint8_t held_out = photo.held_out ? 1 : 0;
        sum = io::crc32_of(std::as_bytes(std::span(&held_out, 1)), sum);
        sum = io::crc32_of(std::as_bytes(std::span(photo.nearness)), sum);
        sum = io::crc32_of(std::as_bytes(std::span(photo.normals)), sum);
    }
    for (const auto& color : photos.colors)
        sum = io::crc32_of(std::as_bytes(std::span(color)), sum);
    for (const scene::Vec3& point : photos.points)
        sum = io::crc32_of(std::as_bytes(std::span(glm::value_ptr(point), 3)), sum);
    return sum;
}

/// Until steps are chosen, with room for the most Gaussians of any length.
Schedule schedule_of(const ScheduleDesc& desc, std::uint64_t steps) {
    return steps != 0 ? Schedule::of_steps(desc, steps) : Schedule::of_seconds(desc, 1e3);
}

}  // namespace

/// Cut the fit to what there is.
Status FitTask::cut_memory(const FitCosts& costs, std::span<const data::PosedPhoto> sizes,
                           std::uint32_t wanted, std::uint64_t left, run::Messages& messages) {
    const bool bound = options_.memory != 0;
    const bool shared = !bound && context_->device().info().kind == vk::DeviceKind::kCpu;
    const std::uint64_t there = bound ? std::min(options_.memory, left) : left;
    const MemoryWish wish{wanted, first_ ? static_cast<std::uint32_t>(first_->count()) : 0,
                          static_cast<std::uint32_t>(options_.memory_downscale)};
    SPLAT_ASSIGN(const MemoryPlan plan, plan_memory(costs, sizes, there, shared, wish));
    const std::string lack = megabytes(there);
    if (plan.gaussians < wanted) {
        options_.memory_gaussians = plan.gaussians;
        messages.push_back({format("warning: at most %u Gaussians instead of %u, for which %s are "
                                   "too little memory",
                                   plan.gaussians, wanted, lack.c_str()),
                            true});
    }
    if (plan.factor > options_.memory_downscale) {
        options_.memory_downscale = plan.factor;
        messages.push_back({format("warning: the sides of photographs are divided by %u, as %s are "
                                   "too little memory for more",
                                   plan.factor, lack.c_str()),
                            true});
    }
    return {};
}

/// Estimate what the fit takes of the device, and, in a new run, cut it to what there is.
Status FitTask::choose_memory(std::vector<data::PosedPhoto>& fitted, Priors& priors,
                              ScheduleDesc& desc, run::Messages& messages) {
    std::uint64_t left = 0;
    auto measured = on_device([&]() -> Result<FitCosts> {
        SPLAT_TRY(context_->device().alive());
        left = memory_left(*context_);
        limit_ = options_.memory == 0 ? limit_ : context_->memory().use().used + options_.memory;
        return Fitter::costs(*context_, desc.sh_degree,
                             !fitted[0].nearness.empty() || !fitted[0].normals.empty(),
                             options_.refine_poses, options_.refine_exposure);
    });
    SPLAT_ASSIGN(const FitCosts costs, std::move(measured));
    // Both are given to repeat a fit.
    const bool is_chosen =
        resumed_ || (options_.memory_downscale != 0 && options_.memory_gaussians != 0);
    std::uint64_t& factor = options_.memory_downscale;
    factor = std::max<std::uint64_t>(factor, 1);
    std::vector<data::PosedPhoto> sizes;  // without pixels
    for (const auto* const photos : {&fitted, &held_out_})
        for (const data::PosedPhoto& photo : *photos) {
            const std::uint32_t side = std::min(photo.width, photo.height);
            if (factor > side)
                return invalid(
                    "memory_downscale is %llu, expected at most %u, the shorter side of "
                    "'%s'",
                    llu(factor), side, shown(photo.name).c_str());
            sizes.emplace_back().held_out = photo.held_out;
            sizes.back().width = photo.width;
            sizes.back().height = photo.height;
        }
    std::uint32_t wanted = schedule_of(desc, options_.steps).most_gaussians();
    if (options_.memory_gaussians != 0)
        wanted = std::min(wanted, static_cast<std::uint32_t>(options_.memory_gaussians));
    if (!is_chosen) SPLAT_TRY(cut_memory(costs, sizes, wanted, left, messages));
    if (options_.memory_gaussians != 0)
        desc.capacity = static_cast<std::uint32_t>(options_.memory_gaussians);
    memory_ = fit_memory(costs, sizes, std::min(wanted, desc.capacity),
                         static_cast<std::uint32_t>(factor));
    messages.push_back({format(
        "the fit takes about %s of the device: photographs %s, Gaussians %s, rasterizer %s, loss "
        "%s, unused %s; and %s more of the host for reduced photographs and states",
        megabytes(memory_.device()).c_str(), megabytes(memory_.photographs).c_str(),
        megabytes(memory_.gaussians).c_str(), megabytes(memory_.rasterizer).c_str(),
        megabytes(memory_.loss).c_str(), megabytes(memory_.blocks).c_str(),
        megabytes(memory_.host).c_str())});
    return factor == 1 ? Status() : reduce_photos(fitted, priors, desc, messages);
}

/// Divide the sides of all photographs. Those that are left without a valid pixel are dropped.
Status FitTask::reduce_photos(std::vector<data::PosedPhoto>& fitted, Priors& priors,
                              ScheduleDesc& desc, run::Messages& messages) {
    const auto factor = static_cast<std::uint32_t>(options_.memory_downscale);
    const std::size_t all = fitted.size() + held_out_.size();
    std::vector<std::string> empty;
    const auto keep = [&](std::vector<data::PosedPhoto>& photos, auto also) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < photos.size(); ++i) {
            data::PosedPhoto photo = data::reduce(photos[i], factor);
            photos[i] = {};
            if (std::ranges::all_of(photo.pixels, [](std::uint32_t p) { return p == 0; })) {
                empty.push_back(photo.name);
                continue;
            }
            also(i, kept);
            photos[kept++] = std::move(photo);
        }
        photos.resize(kept);
    };
    keep(fitted, [&](std::size_t from, std::size_t to) {
        priors.alignments[to] = priors.alignments[from];
    });
    keep(held_out_, [](std::size_t, std::size_t) {});
    fitted_ = fitted.size();
    priors.alignments.resize(fitted_);
    if (!empty.empty()) {
        const std::string lack = format(
            "%zu of %zu photographs have no pixel that counts at 1/%u of their sides, such "
            "as '%s'",
            empty.size(), all, factor, shown(empty[0]).c_str());
        if (fitted_ < 2) return damaged("'%s': %s", options_.data.c_str(), lack.c_str());
        messages.push_back({lack + ", and are left out"});
    }
    desc.pixels = 0;
    for (const data::PosedPhoto& photo : fitted)
        desc.pixels += static_cast<double>(photo.pixels.size()) / static_cast<double>(fitted_);
    return {};
}

Status FitTask::open_data(run::Messages& messages) {
    SPLAT_ASSIGN(data::PosedPhotos photos,
                 load_photos(*context_, options_.data, photos_of(options_)));
    for (const std::string& notice : photos.notices) messages.push_back({notice});
    if (options_.refine_poses)
        messages.push_back(
            {"poses are refined from a fifth of the fit on: transforms.json in the "
             "run's folder gets the cameras, for pictures of the fit's size"});
    data_sum_ = sum_of(photos);
    frame_ = center_photos(photos.photos);
    std::vector<data::PosedPhoto> fitted;
    double pixels = 0;
    for (data::PosedPhoto& photo : photos.photos) {
        if (photo.held_out) {
            held_out_.push_back(std::move(photo));
            continue;
        }
        pixels += static_cast<double>(photo.pixels.size());
        fitted.push_back(std::move(photo));
    }
    fitted_ = fitted.size();
    points_.positions = std::move(photos.points);
    points_.colors = std::move(photos.colors);
    for (scene::Vec3& place : points_.positions) place -= frame_.center;
    SPLAT_ASSIGN(Priors priors, choose_first(fitted, messages));
    ScheduleDesc desc{.gaussians = static_cast<std::uint32_t>(first_count()),
                      .most_gaussians = static_cast<std::uint32_t>(options_.max_gaussians),
                      .pixels = pixels / static_cast<double>(fitted_),
                      .extent = frame_.extent,
                      .sh_degree = static_cast<std::uint32_t>(options_.sh_degree),
                      .least_degree = first_ ? first_->sh_degree : 0,
                      .strategy = strategy_of(options_)};
    SPLAT_TRY(choose_memory(fitted, priors, desc, messages));
    Schedule schedule = schedule_of(desc, options_.steps);
    auto made = on_device([&]() -> Result<std::unique_ptr<Fitter>> {
        return Fitter::create(
            *context_, {std::move(fitted), std::move(schedule), options_.seed, frame_.near_plane(),
                        options_.white_background ? kWhite : std::array<float, 3>{},
                        std::move(priors), options_.refine_poses, options_.refine_exposure});
    });
    SPLAT_ASSIGN(fitter_, std::move(made));
    return {};
}

Status FitTask::choose_steps(run::Messages& messages) {
    if (options_.steps != 0) return {};
    const ScheduleDesc desc = fitter_->schedule().desc();
    const auto schedule_of_seconds = [&](double slowness) {
        return Schedule::of_seconds(desc, std::min(options_.seconds / slowness, kLongestSeconds));
    };
    const auto measure = [&](std::size_t least, double& slowness) -> Status {
        SPLAT_TRY(place_first(least));
        return sparing([&]() -> Status {
            SPLAT_SET(slowness, fitter_->slowness());
            return {};
        });
    };
    // Most steps draw a set that has grown: copies in the places of the first Gaussians take about as long.
    constexpr double kGrown = 0.75;
    double slowness = 0, grown = 0;
    SPLAT_TRY(measure(0, slowness));
    SPLAT_TRY(measure(schedule_of_seconds(slowness).most_gaussians(), grown));
    slowness = std::lerp(slowness, grown, kGrown);
    // Steps of fewer Gaussians or other sizes may have the memory that was missing.
    spared_.clear();
    SPLAT_TRY(on_device([&]() -> Status {
        fitter_->set_spared({});
        return {};
    }));
    options_.steps = schedule_of_seconds(slowness).steps();
    if (options_.seconds / slowness > kLongestSeconds || options_.steps == kMostSteps)
        messages.push_back({format("warning: %g s are more than a fit of a number of seconds goes "
                                   "on for: it has %llu steps",
                                   options_.seconds, llu(options_.steps)),
                            true});
    else
        messages.push_back(
            {format("%llu steps take about %.3g s here, %.2f times as long as the cost model says",
                    llu(options_.steps), options_.seconds, slowness)});
    // The schedule is that of a run which is repeated by its steps.
    fitter_->set_schedule(Schedule::of_steps(desc, options_.steps));
    return {};
}

Result<run::Plan> FitTask::prepare(const run::ReadText* config, run::Messages& messages) {
    resumed_ = config != nullptr;
    if (!resumed_)
        SPLAT_SET(options_, options_of(given_));
    else
        SPLAT_SET(options_, options_of_run(*config, given_));
    SPLAT_TRY(open_data(messages));
    SPLAT_TRY(choose_steps(messages));
    SPLAT_TRY(check_first());
    run::Plan plan;
    plan.config = config_text(options_);
    plan.iterations = options_.steps;
    plan.log_every = std::max<std::uint64_t>(options_.steps / 200, 1);
    plan.validate_every = ceil_div(options_.steps, kValidations);
    plan.save_every = plan.validate_every;
    plan.pieces = static_cast<std::uint32_t>(held_out_.size());
    plan.protocol = {{"val_views", static_cast<double>(held_out_.size())}};
    plan.protocol_text = "numbers of views";
    plan.score = "held-out PSNR";
    plan.results = {"gaussians"};
    plan.if_interrupted = "--resume continues it";
    plan.if_not_finite = "look at the cameras and photographs, and begin with other points";
    plan.if_not_drawn = "look at the poses: nothing lies in front of the cameras";
    return plan;
}

Status FitTask::start(run::Messages&) {
    return place_first();
}

Status FitTask::recall(const JsonTree& run_json, const std::string& path) {
    if (run_json["data_crc32"].count()) return {};
    return damaged("'%s' has no number 'data_crc32': the run is no fit", path.c_str());
}

Status FitTask::compare(const JsonTree& run_json, run::Messages&) {
    const std::optional<std::uint64_t> sum = run_json["data_crc32"].count();
    if (!sum || *sum == data_sum_) return {};  // or a damaged run.json
    return invalid(
        "the photographs, cameras, maps or points of '%s' have changed since the run began; its "
        "steps "
        "depend on them: restore them, or begin a new run",
        options_.data.c_str());
}

Status FitTask::load(const io::WeightsFile& state) {
    const auto number = [&](const char* key) -> Result<std::uint64_t> {
        for (const auto& [name, text] : state.metadata) {
            if (name != key) continue;
            if (const auto value = number_in<std::uint64_t>(text)) return *value;
        }
        return damaged("the state has no number '%s' in its metadata: it is not that of a fit",
                       key);
    };
    SPLAT_ASSIGN(const std::uint64_t step, number("step"));
    SPLAT_ASSIGN(const std::uint64_t attempts, number("attempts"));
    SPLAT_ASSIGN(const std::uint64_t expected, number("crc32"));
    if (const std::uint32_t sum = io::crc32_of(state.tensors); sum != expected)
        return damaged("the checksum of the state is %08x, expected %08llx: the file is damaged",
                       sum, llu(expected));
    if (step > options_.steps)
        return damaged("the state is of step %llu, but the fit has %llu", llu(step),
                       llu(options_.steps));
    SPLAT_ASSIGN(const std::uint64_t grown, number("grown"));
    Spared spared;
    SPLAT_ASSIGN(const std::uint64_t most, number("most_gaussians"));
    SPLAT_ASSIGN(const std::uint64_t views, number("step_views"));
    spared.most_gaussians = static_cast<std::uint32_t>(most);
    spared.views = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(views, 1, kStepViews));
    SPLAT_TRY(on_device([&] { return fitter_->load(state.tensors, grown, spared); }));
    steps_ = step;
    attempts_ = attempts;
    return {};
}

}  // namespace splat::fit
