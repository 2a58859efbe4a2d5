#include "api/api_guard.h"
#include "api/handles.h"
#include "api/run/run_desc.h"
#include "api/train/settings.h"
#include "api/train/trainer_info.h"
#include "train/splatter_training.h"

using namespace splat;

namespace {

constexpr std::uint32_t kLoadFlags = SPLAT_LOAD_GRAFT | SPLAT_LOAD_TAKE_RAYS |
                                     SPLAT_LOAD_FROM_DEPTH | SPLAT_LOAD_FROM_NORMAL |
                                     SPLAT_LOAD_FROM_MASK;

/// An open data set of the caller, or null. Errors: kInvalidHandle.
Status take_dataset(splat_dataset handle, const char* field,
                    std::shared_ptr<data::Dataset>& dataset) {
    if (handle == nullptr) return {};
    SPLAT_ASSIGN(const auto found, api::Datasets::find(handle, field));
    dataset = api::dataset_of(found);
    return {};
}

Result<train::TrainingDesc> desc_of(const splat_training_desc& given) {
    if ((given.init_flags & ~kLoadFlags) != 0)
        return invalid(
            "splat_training_desc.init_flags has unknown bits %#x: bits of "
            "splat_model_load without SPLAT_LOAD_ADAPTERS",
            given.init_flags & ~kLoadFlags);
    if (given.init == nullptr && given.init_flags != 0)
        return invalid(
            "splat_training_desc.init_flags is %#x, but init is NULL, so that they have no "
            "effect: expected 0",
            given.init_flags);
    train::TrainingDesc desc;
    if (given.config != nullptr) desc.config = given.config;
    SPLAT_ASSIGN(desc.changes, api::texts_of(given.values, given.value_count));
    SPLAT_TRY(take_dataset(given.dataset, "splat_training_desc.dataset", desc.dataset));
    SPLAT_TRY(take_dataset(given.validation, "splat_training_desc.validation", desc.validation));
    if (given.init != nullptr) desc.init = given.init;
    const auto has = [&](std::uint32_t flag) { return (given.init_flags & flag) != 0; };
    desc.init_options.graft = has(SPLAT_LOAD_GRAFT);
    desc.init_options.take_rays = has(SPLAT_LOAD_TAKE_RAYS);
    desc.init_options.source = {has(SPLAT_LOAD_FROM_DEPTH), has(SPLAT_LOAD_FROM_NORMAL),
                                has(SPLAT_LOAD_FROM_MASK)};
    return desc;
}

/// Errors: also kInvalidArgument for a run of another task.
Result<std::shared_ptr<api::RunObject>> training_of(splat_run run) {
    SPLAT_ASSIGN(auto object, api::find(run));
    if (object->trainer == nullptr)
        return invalid("run is no training, expected a run of splat_training_open");
    return object;
}

}  // namespace

splat_result splat_training_open(splat_device device, const splat_training_desc* desc,
                                 splat_run* run) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto owner, api::find(device));
        SPLAT_TRY(api::require(run, "run"));
        SPLAT_TRY(api::check_desc(desc, SPLAT_TRAINING_RESUME | SPLAT_TRAINING_OVERWRITE));
        SPLAT_ASSIGN(const run::RunDesc made,
                     api::run_desc_of(*desc, SPLAT_TRAINING_RESUME, SPLAT_TRAINING_OVERWRITE));
        SPLAT_ASSIGN(train::TrainingDesc asked, desc_of(*desc));
        SPLAT_TRY(owner->test(api::kAllKernels));
        const vk::DeviceCall call(owner->context->mutex);
        auto task = std::make_unique<train::SplatterTraining>(owner->context, std::move(asked));
        const train::SplatterTraining& training = *task;
        auto object = std::make_shared<api::RunObject>(owner->context);
        SPLAT_ASSIGN(object->run, run::Run::open(made, std::move(task), object->interrupt));
        object->trainer = training.trainer();
        object->figures.set(object->run->figures());
        *run = api::Runs::add(std::move(object));
        return {};
    });
}

splat_result splat_training_last_step(splat_run run, splat_trainer_info* info) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, training_of(run));
        SPLAT_TRY(api::check_fill(info, "info"));
        const auto last = object->trainer->last();
        if (!last)
            return bad_state(
                "this session has done no step yet; call splat_run_next until an event is "
                "SPLAT_EVENT_STEP");
        api::give(api::info_of(*last), info);
        return {};
    });
}

splat_result splat_training_model(splat_run run, splat_model* model) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, training_of(run));
        SPLAT_TRY(api::require(model, "model"));
        *model = api::Models::add(api::model_of(object->context, object->trainer));
        return {};
    });
}
