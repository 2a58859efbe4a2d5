#include "api/api_guard.h"
#include "api/handles.h"
#include "api/run/run_desc.h"
#include "api/train/settings.h"
#include "api/train/trainer_info.h"
#include "run/follower.h"
#include "train/splatter_training.h"

using namespace splat;

namespace {

constexpr std::uint32_t kLoadFlags = SPLAT_LOAD_GRAFT | SPLAT_LOAD_TAKE_RAYS |
                                     SPLAT_LOAD_FROM_DEPTH | SPLAT_LOAD_FROM_NORMAL |
                                     SPLAT_LOAD_FROM_MASK | SPLAT_LOAD_FROM_PLANE;

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
                                has(SPLAT_LOAD_FROM_MASK), has(SPLAT_LOAD_FROM_PLANE)};
    return desc;
}

/// Null: this rank is the only one. Errors: kInvalidArgument.
Result<std::shared_ptr<run::Group>> group_of(const splat_training_desc& given) {
    std::shared_ptr<run::Group> none;
    if (given.group == nullptr) return none;
    splat_group group{};
    SPLAT_TRY(api::take_input(given.group, "splat_training_desc.group", group));
    const run::GroupCalls calls{group.rank,      group.count,   group.user, group.send_receive,
                                group.broadcast, group.barrier, group.sum,  group.describe};
    SPLAT_TRY(run::Group::check(calls));
    if (calls.count == 1) return none;
    return std::make_shared<run::Group>(calls);
}

using Task = std::unique_ptr<train::SplatterTraining>;

/// Check what needs no other rank. `made`: of rank 0.
Result<Task> task_of(api::DeviceObject& owner, const splat_training_desc& given,
                     const std::shared_ptr<run::Group>& group, run::RunDesc& made) {
    if (group != nullptr) SPLAT_TRY(owner.be_rank(group));
    if (group == nullptr || group->leads())
        SPLAT_SET(made, api::run_desc_of(given, SPLAT_TRAINING_RESUME, SPLAT_TRAINING_OVERWRITE));
    made.group = group.get();
    SPLAT_ASSIGN(train::TrainingDesc asked, desc_of(given));
    asked.group = group.get();
    SPLAT_TRY(owner.test(api::kAllKernels));
    return std::make_unique<train::SplatterTraining>(owner.context, std::move(asked));
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
        splat_training_desc given{};
        SPLAT_TRY(api::take_input(desc, "desc", given));
        auto object = std::make_shared<api::RunObject>(owner->context);
        SPLAT_SET(object->group, group_of(given));
        run::Group* const group = object->group.get();
        run::RunDesc made;
        auto task = task_of(*owner, given, object->group, made);
        SPLAT_TRY(group == nullptr ? task.status() : group->agree(task.status()));
        const train::SplatterTraining& training = *task.value();
        const vk::DeviceCall call(owner->context->mutex);
        if (group == nullptr || group->leads())
            SPLAT_SET(object->run,
                      run::Run::open(made, std::move(task.value()), object->interrupt));
        else
            SPLAT_SET(object->run, run::Follower::open(*group, splat_version_string(),
                                                       std::move(task.value()), object->interrupt));
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
