#include <optional>
#include <shared_mutex>

#include "api/api_guard.h"
#include "api/handles.h"
#include "api/run/run_desc.h"
#include "api/train/settings.h"
#include "fit/fit_task.h"

using namespace splat;

namespace {

constexpr std::uint32_t kFlags = SPLAT_FIT_RESUME | SPLAT_FIT_OVERWRITE | SPLAT_FIT_ALL_PHOTOS |
                                 SPLAT_FIT_WHITE_BACKGROUND | SPLAT_FIT_REFINE_POSES |
                                 SPLAT_FIT_REFINE_EXPOSURE;

/// A number of the struct, of which 0 stands for the default or, in a run that is resumed, for the run's.
std::optional<std::uint64_t> given_of(std::uint64_t value) {
    return value == 0 ? std::nullopt : std::optional(value);
}

Result<fit::FitDesc> desc_of(const splat_fit_desc& given) {
    static constexpr const char* kCameras[] = {"auto", "colmap", "transforms"};
    if ((given.flags & SPLAT_FIT_RESUME) == 0)
        SPLAT_TRY(api::require(given.data, "splat_fit_desc.data"));
    if (given.sh_bands > 4)
        return invalid("splat_fit_desc.sh_bands is %u, expected 1 to 4, or 0", given.sh_bands);
    if (given.cameras < 0 || given.cameras > SPLAT_FIT_CAMERAS_TRANSFORMS)
        return invalid("splat_fit_desc.cameras is %d, expected a SPLAT_FIT_CAMERAS_ value",
                       given.cameras);
    const bool all = (given.flags & SPLAT_FIT_ALL_PHOTOS) != 0;
    if (all && given.test_every != 0)
        return invalid(
            "splat_fit_desc.test_every is %u, but no photograph is held out with "
            "SPLAT_FIT_ALL_PHOTOS: expected 0",
            given.test_every);
    fit::FitDesc desc;
    if (given.data != nullptr) desc.data = given.data;
    if (given.masks != nullptr) desc.masks = given.masks;
    if (given.cameras != SPLAT_FIT_CAMERAS_AUTO) desc.cameras = kCameras[given.cameras];
    if ((given.flags & SPLAT_FIT_WHITE_BACKGROUND) != 0) desc.white_background = true;
    desc.downscale = given_of(given.downscale);
    desc.test_every = all ? std::optional<std::uint64_t>(0) : given_of(given.test_every);
    desc.steps = given_of(given.steps);
    if (given.seconds != 0) desc.seconds = given.seconds;
    desc.max_gaussians = given_of(given.max_gaussians);
    if (given.sh_bands != 0) desc.sh_degree = given.sh_bands - 1;
    desc.seed = given_of(given.seed);
    if (given.depth != nullptr) desc.depth = given.depth;
    if (given.normals != nullptr) desc.normals = given.normals;
    if (given.init != nullptr) desc.init = given.init;
    desc.memory = given_of(given.memory_bytes);
    if ((given.flags & SPLAT_FIT_REFINE_POSES) != 0) desc.refine_poses = true;
    if ((given.flags & SPLAT_FIT_REFINE_EXPOSURE) != 0) desc.refine_exposure = true;
    SPLAT_ASSIGN(desc.values, api::texts_of(given.values, given.value_count));
    return desc;
}

}  // namespace

splat_result splat_fit_open(splat_device device, const splat_fit_desc* desc, splat_run* run) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto owner, api::find(device));
        SPLAT_TRY(api::require(run, "run"));
        SPLAT_TRY(api::check_desc(desc, kFlags));
        SPLAT_ASSIGN(const run::RunDesc made,
                     api::run_desc_of(*desc, SPLAT_FIT_RESUME, SPLAT_FIT_OVERWRITE));
        SPLAT_ASSIGN(fit::FitDesc asked, desc_of(*desc));
        SPLAT_TRY(owner->test(api::kAllKernels));
        const vk::DeviceCall call(owner->context->mutex);
        auto task = std::make_unique<fit::FitTask>(owner->context, std::move(asked));
        auto object = std::make_shared<api::RunObject>(owner->context);
        object->fit = task.get();
        SPLAT_ASSIGN(object->run, run::Run::open(made, std::move(task), object->interrupt));
        object->figures.set(object->run->figures());
        *run = api::Runs::add(std::move(object));
        return {};
    });
}

splat_result splat_fit_scene(splat_run run, splat_scene* scene) {
    return api::create_of(run, scene, [](const auto& object) -> api::Scenes::Made {
        if (object->fit == nullptr)
            return invalid("run is no fit, expected a run of splat_fit_open");
        auto made = std::make_shared<api::SceneObject>();
        SPLAT_ASSIGN(made->gaussians, object->fit->scene());
        return made;
    });
}

splat_result splat_fit_score(splat_device device, const splat_fit_desc* desc, splat_scene scene,
                             double border, splat_run* run) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto owner, api::find(device));
        SPLAT_ASSIGN(const auto from, api::find(scene));
        SPLAT_TRY(api::require(run, "run"));
        SPLAT_TRY(api::check_desc(desc, kFlags));
        splat_fit_desc read{};  // without what only a fit reads
        read.flags = desc->flags & (SPLAT_FIT_ALL_PHOTOS | SPLAT_FIT_WHITE_BACKGROUND);
        SPLAT_COPY(read, *desc, data, masks, downscale, test_every, cameras);
        SPLAT_ASSIGN(const fit::FitDesc asked, desc_of(read));
        SPLAT_ASSIGN(const fit::FitOptions options, fit::options_of(asked));
        SPLAT_TRY(owner->test(api::kAllKernels));
        const vk::DeviceCall call(owner->context->mutex);
        scene::Gaussians gaussians;
        {
            const std::shared_lock lock(from->mutex);
            gaussians = from->gaussians;
        }
        auto object = std::make_shared<api::RunObject>(owner->context);
        const fit::SceneScoresDesc what{options.data, fit::photos_of(options), border};
        SPLAT_ASSIGN(object->run, fit::SceneScores::open(owner->context, what, std::move(gaussians),
                                                         object->interrupt));
        object->figures.set(object->run->figures());
        *run = api::Runs::add(std::move(object));
        return {};
    });
}
