#include "api/api_guard.h"
#include "api/handles.h"

using namespace splat;
using run::EventKind;

static_assert(static_cast<int>(EventKind::kMessage) == SPLAT_EVENT_MESSAGE);
static_assert(static_cast<int>(EventKind::kStep) == SPLAT_EVENT_STEP);
static_assert(static_cast<int>(EventKind::kValidatedPiece) == SPLAT_EVENT_VALIDATED_PIECE);
static_assert(static_cast<int>(EventKind::kValidation) == SPLAT_EVENT_VALIDATION);
static_assert(static_cast<int>(EventKind::kCheckpoint) == SPLAT_EVENT_CHECKPOINT);
static_assert(static_cast<int>(EventKind::kDone) == SPLAT_EVENT_DONE);
static_assert(static_cast<int>(EventKind::kInterrupted) == SPLAT_EVENT_INTERRUPTED);
static_assert(static_cast<int>(EventKind::kNotFinite) == SPLAT_EVENT_NOT_FINITE);
static_assert(static_cast<int>(EventKind::kNothingDrawn) == SPLAT_EVENT_NOTHING_DRAWN);

namespace {

/// What it points to is the object's.
splat_run_event value_of(api::RunObject& object) {
    const run::Event& from = object.event;
    object.numbers.clear();
    for (const run::Number& number : from.numbers)
        object.numbers.push_back({number.name, number.value});
    splat_run_event event{};
    event.kind = static_cast<splat_run_event_kind>(from.kind);
    if (!from.text.empty()) event.text = from.text.c_str();
    SPLAT_COPY(event, from, warning, updated, logged, step, attempts, iterations, skipped,
               peak_bytes, seconds, steps_per_second);
    if (!object.numbers.empty()) event.numbers = object.numbers.data();
    event.number_count = object.numbers.size();
    event.piece = from.piece;
    event.pieces = from.pieces;
    if (from.kind != EventKind::kValidatedPiece) return event;
    const run::Piece& piece = from.validated;
    event.name = piece.name.c_str();
    SPLAT_COPY(event, piece, views, inputs, width, height);
    event.image_count = piece.images.size();
    event.images = piece.images.data();
    event.truths = piece.truths.data();
    return event;
}

}  // namespace

splat_result splat_run_next(splat_run run, splat_run_event* event) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::find(run));
        SPLAT_TRY(api::require(event, "event"));
        SPLAT_TRY(api::check_filled(*event));
        const vk::DeviceCall call(object->context->mutex);
        const Status done = object->run->next(object->event);
        object->figures.set(object->run->figures());
        SPLAT_TRY(done);
        api::give(value_of(*object), event);
        return {};
    });
}

splat_result splat_run_interrupt(splat_run run) {
    if (api::Runs::interrupt(run)) return SPLAT_OK;
    return api::guarded([&] { return api::find(run).status(); });
}

splat_result splat_run_report(splat_run run, char* buffer, size_t capacity, size_t* needed) {
    return api::report(run, buffer, capacity, needed,
                       [](auto& object) { return run::figures_json(object.figures.get()); });
}
