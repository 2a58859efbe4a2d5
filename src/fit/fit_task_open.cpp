// What a fit begins with: options, photographs, points, the number of steps, or a state.

#include <algorithm>
#include <cmath>

#include "core/checked_math.h"
#include "core/json_writer.h"
#include "core/number_in.h"
#include "fit/first_gaussians.h"
#include "fit/fit_task.h"
#include "io/compress.h"
#include "io/file.h"
#include "scene/camera_pose.h"

namespace splat::fit {
namespace {

constexpr double kLongestSeconds = 1e5;  ///< by the cost model, for a number of seconds
constexpr std::uint32_t kRandomPoints = 10000;
constexpr std::uint64_t kValidations = 5;  ///< in a fit
constexpr std::array<float, 3> kWhite = {1, 1, 1};
constexpr double kNear = 0.0025;  ///< near plane, in extents of the cameras

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
    }
    for (const auto& color : photos.colors)
        sum = io::crc32_of(std::as_bytes(std::span(color)), sum);
    for (const scene::Vec3& point : photos.points)
        sum = io::crc32_of(std::as_bytes(std::span(glm::value_ptr(point), 3)), sum);
    return sum;
}

}  // namespace

Status FitTask::open_data(run::Messages& messages) {
    SPLAT_ASSIGN(data::PosedPhotos photos,
                 data::load_posed_photos(options_.data, photos_of(options_)));
    for (const std::string& notice : photos.notices) messages.push_back({notice});
    data_sum_ = sum_of(photos);
    // The fit's origin lies amid the cameras, for float32's sake.
    std::vector<scene::Vec3> centers;
    for (const data::PosedPhoto& photo : photos.photos)
        centers.push_back(scene::camera_center(photo.camera));
    for (const scene::Vec3& center : centers)
        center_ += center / static_cast<double>(centers.size());
    double extent = 0;
    for (const scene::Vec3& center : centers)
        extent = std::max(extent, 1.1 * glm::length(center - center_));
    if (!(extent > 0)) extent = 1;
    std::vector<data::PosedPhoto> fitted;
    double pixels = 0;
    for (data::PosedPhoto& photo : photos.photos) {
        scene::Mat4& pose = photo.camera.world_to_camera;
        pose = scene::make_pose(scene::rotation_of(pose),
                                scene::translation_of(pose) + scene::rotation_of(pose) * center_);
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
    for (scene::Vec3& place : points_.positions) place -= center_;
    if (points_.positions.size() < 2) {
        std::vector<scene::Camera> cameras;
        for (const data::PosedPhoto& photo : fitted) cameras.push_back(photo.camera);
        points_ = random_points(cameras, kRandomPoints, options_.seed);
        if (points_.positions.size() < 2)
            return damaged(
                "'%s' has no points to begin with, and hardly a place that two of its cameras see: "
                "look at their poses",
                options_.data.c_str());
        messages.push_back(
            {format("no points to begin with: %zu random ones, where the cameras look",
                    points_.positions.size())});
    }
    const ScheduleDesc desc{.gaussians = static_cast<std::uint32_t>(points_.positions.size()),
                            .most_gaussians = static_cast<std::uint32_t>(options_.max_gaussians),
                            .pixels = pixels / static_cast<double>(fitted_),
                            .extent = extent,
                            .sh_degree = static_cast<std::uint32_t>(options_.sh_degree)};
    // Until steps are chosen, room for the most Gaussians of any length.
    Schedule schedule = options_.steps != 0 ? Schedule::of_steps(desc, options_.steps)
                                            : Schedule::of_seconds(desc, 1e3);
    auto made = on_device([&]() -> Result<std::unique_ptr<Fitter>> {
        SPLAT_TRY(context_->device().alive());
        return Fitter::create(
            *context_, {std::move(fitted), std::move(schedule), options_.seed, kNear * extent,
                        options_.white_background ? kWhite : std::array<float, 3>{}});
    });
    SPLAT_ASSIGN(fitter_, std::move(made));
    return {};
}

Status FitTask::place_first() {
    SPLAT_ASSIGN(const scene::Gaussians first,
                 first_gaussians(points_, fitter_->schedule().first_gaussians(), options_.seed));
    return on_device([&] { return fitter_->begin(first); });
}

Status FitTask::choose_steps(run::Messages& messages) {
    if (options_.steps != 0) return {};
    SPLAT_TRY(place_first());
    auto timed = on_device([&] { return fitter_->slowness(); });
    SPLAT_ASSIGN(const double slowness, std::move(timed));
    const ScheduleDesc desc = fitter_->schedule().desc();
    const double wanted = options_.seconds / slowness;
    options_.steps = Schedule::of_seconds(desc, std::min(wanted, kLongestSeconds)).steps();
    if (wanted > kLongestSeconds || options_.steps == kMostSteps)
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

Result<run::Plan> FitTask::prepare(const std::string* config, run::Messages& messages) {
    if (config == nullptr)
        SPLAT_SET(options_, options_of(given_));
    else
        SPLAT_SET(options_, options_of_run(*config, given_));
    SPLAT_TRY(open_data(messages));
    SPLAT_TRY(choose_steps(messages));
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
        "the photographs, cameras or points in '%s' have changed since the run began; its steps "
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
    SPLAT_TRY(on_device([&] { return fitter_->load(state.tensors, grown); }));
    steps_ = step;
    attempts_ = attempts;
    return {};
}

}  // namespace splat::fit
