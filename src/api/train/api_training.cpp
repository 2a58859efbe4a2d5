#include "api/api_guard.h"
#include "api/handles.h"
#include "api/train/settings.h"
#include "api/train/trainer_info.h"

using namespace splat;

static_assert(static_cast<int>(train::EventKind::kMessage) == SPLAT_EVENT_MESSAGE);
static_assert(static_cast<int>(train::EventKind::kStep) == SPLAT_EVENT_STEP);
static_assert(static_cast<int>(train::EventKind::kValidatedObject) == SPLAT_EVENT_VALIDATED_OBJECT);
static_assert(static_cast<int>(train::EventKind::kValidation) == SPLAT_EVENT_VALIDATION);
static_assert(static_cast<int>(train::EventKind::kCheckpoint) == SPLAT_EVENT_CHECKPOINT);
static_assert(static_cast<int>(train::EventKind::kDone) == SPLAT_EVENT_DONE);
static_assert(static_cast<int>(train::EventKind::kInterrupted) == SPLAT_EVENT_INTERRUPTED);
static_assert(static_cast<int>(train::EventKind::kNotFinite) == SPLAT_EVENT_NOT_FINITE);
static_assert(static_cast<int>(train::EventKind::kNothingDrawn) == SPLAT_EVENT_NOTHING_DRAWN);

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
    using Mode = train::RunFolder::Mode;
    constexpr std::uint32_t kBoth = SPLAT_TRAINING_RESUME | SPLAT_TRAINING_OVERWRITE;
    SPLAT_TRY(api::require(given.folder, "splat_training_desc.folder"));
    if ((given.flags & kBoth) == kBoth)
        return error(Code::kInvalidArgument,
                     "splat_training_desc.flags ask to resume the run and to overwrite it, "
                     "expected one of them");
    if ((given.init_flags & ~kLoadFlags) != 0)
        return error(Code::kInvalidArgument,
                     "splat_training_desc.init_flags has unknown bits %#x: bits of "
                     "splat_model_load without SPLAT_LOAD_ADAPTERS",
                     given.init_flags & ~kLoadFlags);
    if (given.init == nullptr && given.init_flags != 0)
        return error(
            Code::kInvalidArgument,
            "splat_training_desc.init_flags is %#x, but init is NULL, so that they have no "
            "effect: expected 0",
            given.init_flags);
    train::TrainingDesc desc;
    desc.folder = given.folder;
    desc.mode = (given.flags & SPLAT_TRAINING_RESUME) != 0      ? Mode::kResume
                : (given.flags & SPLAT_TRAINING_OVERWRITE) != 0 ? Mode::kReplace
                                                                : Mode::kNew;
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
    desc.library = splat_version_string();
    return desc;
}

splat_training_event value_of(api::TrainingObject& object) {
    const train::Event& from = object.event;
    splat_training_event event{};
    event.kind = static_cast<splat_training_event_kind>(from.kind);
    if (!from.text.empty()) event.text = from.text.c_str();
    event.warning = from.warning ? 1 : 0;
    event.logged = from.logged ? 1 : 0;
    event.step = from.step;
    event.attempts = from.attempts;
    event.iterations = from.iterations;
    event.skipped = from.skipped;
    event.peak_bytes = from.peak_bytes;
    if (from.kind == train::EventKind::kStep) {
        object.info = api::info_of(from.result);
        object.info.struct_size = sizeof object.info;
        event.info = &object.info;
    }
    event.psnr = from.psnr;
    event.averaged_loss = from.averaged_loss;
    event.seconds = from.seconds;
    event.steps_per_second = from.steps_per_second;
    event.objects = from.objects;
    event.novel_psnr = from.novel.psnr;
    event.novel_ssim = from.novel.ssim;
    event.conditioning_psnr = from.conditioning.psnr;
    event.conditioning_ssim = from.conditioning.ssim;
    event.views = from.novel.views;
    event.side = object.training->settings().network.resolution;
    event.best_psnr = from.best_psnr;
    if (from.kind != train::EventKind::kValidatedObject) return event;
    event.name = from.scores.name.c_str();
    event.object = from.object;
    event.inputs = from.inputs;
    event.image_count = from.images.size();
    event.views =
        static_cast<std::uint32_t>(from.images.size() / (std::size_t{3} * event.side * event.side));
    event.images = from.images.data();
    event.truths = from.truths.data();
    event.novel_psnr = from.scores.novel.psnr;
    event.novel_ssim = from.scores.novel.ssim;
    event.conditioning_psnr = from.scores.conditioning.psnr;
    event.conditioning_ssim = from.scores.conditioning.ssim;
    return event;
}

}  // namespace

splat_result splat_training_open(splat_device device, const splat_training_desc* desc,
                                 splat_training* training) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto owner, api::Devices::find(device, "device"));
        SPLAT_TRY(api::require(training, "training"));
        SPLAT_TRY(api::check_desc(desc, "splat_training_desc", sizeof(splat_training_desc),
                                  SPLAT_TRAINING_RESUME | SPLAT_TRAINING_OVERWRITE));
        SPLAT_ASSIGN(const train::TrainingDesc made, desc_of(*desc));
        SPLAT_TRY(owner->test(api::kAllKernels));
        auto object = std::make_shared<api::TrainingObject>(owner->context);
        SPLAT_ASSIGN(object->training,
                     train::Training::open(owner->context, made, object->interrupt));
        object->figures.set(object->training->figures());
        *training = api::Trainings::add(std::move(object));
        return {};
    });
}

splat_result splat_training_next(splat_training training, splat_training_event* event) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::Trainings::find(training, "training"));
        SPLAT_TRY(api::require(event, "event"));
        SPLAT_TRY(api::check_filled(*event, "splat_training_event", sizeof(splat_training_event)));
        const Status done = object->training->next(object->event);
        object->figures.set(object->training->figures());
        SPLAT_TRY(done);
        api::give(value_of(*object), event);
        return {};
    });
}

splat_result splat_training_interrupt(splat_training training) {
    if (api::Trainings::interrupt(training)) return SPLAT_OK;
    return api::guarded([&] { return api::Trainings::find(training, "training").status(); });
}

splat_result splat_training_report(splat_training training, char* buffer, size_t capacity,
                                   size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&](auto give) -> Status {
        SPLAT_ASSIGN(const auto object, api::Trainings::find(training, "training"));
        return give(train::figures_json(object->figures.get()));
    });
}

splat_result splat_training_model(splat_training training, splat_model* model) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::Trainings::find(training, "training"));
        SPLAT_TRY(api::require(model, "model"));
        *model = api::Models::add(api::model_of(object->context, object->training->trainer()));
        return {};
    });
}

splat_result splat_training_destroy(splat_training training) {
    return api::destroy<api::Trainings>(training, "training");
}
