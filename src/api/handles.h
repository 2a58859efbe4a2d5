#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "api/objects.h"

namespace splat::api {

/// Live handles. A handle is a number that is used once, so a stale or foreign one is recognised
/// and never followed.
///
/// Errors: kInvalidHandle, naming `argument`; kInvalidState for an object of a device in a process that
/// was forked from the one that opened it; kOutOfHostMemory by exception.
template <class Object, class Handle>
struct Handles {
    using Made = Result<std::shared_ptr<Object>>;
    static Handle add(std::shared_ptr<Object> object);
    static Result<std::shared_ptr<Object>> find(Handle handle, const char* argument);
    /// Accepts NULL, for which the pointer is empty, and objects that find() refuses after a fork.
    static Result<std::shared_ptr<Object>> remove(Handle handle, const char* argument);
    /// Raise the Interrupt of a live device, or of an object with a member `interrupt`. Atomics only.
    /// Returns false if there is none.
    static bool interrupt(Handle handle) noexcept;
};

// The kinds of handles: the name of the kind, the object behind a handle, the handle.
#define SPLAT_HANDLE_KINDS(X)                              \
    X(Devices, DeviceObject, splat_device)                 \
    X(Tensors, TensorObject, splat_tensor)                 \
    X(Ops, OpObject, splat_op)                             \
    X(Scenes, SceneObject, splat_scene)                    \
    X(Rasterizers, RasterizerObject, splat_rasterizer)     \
    X(RasterStates, RasterStateObject, splat_raster_state) \
    X(Weights, WeightsObject, splat_weights)               \
    X(Datasets, DatasetObject, splat_dataset)              \
    X(Models, ModelObject, splat_model)                    \
    X(Modules, ModuleObject, splat_module)                 \
    X(Predictors, PredictorObject, splat_predictor)        \
    X(Trainers, TrainerObject, splat_trainer)              \
    X(Optimizers, OptimizerObject, splat_optimizer)        \
    X(AllBatches, BatchesObject, splat_batches)            \
    X(Runs, RunObject, splat_run)                          \
    X(Lpipses, LpipsObject, splat_lpips)                   \
    X(Evaluators, EvaluatorObject, splat_evaluator)        \
    X(Comparisons, ComparisonObject, splat_comparison)     \
    X(PriorModels, PriorModelObject, splat_prior_model)

#define SPLAT_HANDLE_KIND(kind, object, handle) \
    using kind = Handles<object, handle>;       \
    extern template struct Handles<object, handle>;
SPLAT_HANDLE_KINDS(SPLAT_HANDLE_KIND)
#undef SPLAT_HANDLE_KIND

/// Lock the device of a live handle's object and call `body(object)`. Errors: also kCancelled.
template <class Kind, class Handle, class Body>
Status use(Handle handle, const char* argument, Body&& body) {
    SPLAT_ASSIGN(const auto object, Kind::find(handle, argument));
    const std::lock_guard lock(object->context->mutex);
    SPLAT_TRY(object->context->mutex.check());
    return body(*object);
}

/// An entry point that needs a live object: calls `body(object)` with the shared pointer to it.
template <class Kind, class Handle, class Body>
splat_result with(Handle handle, const char* argument, Body&& body) {
    return guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, Kind::find(handle, argument));
        return body(object);
    });
}

/// An entry point that makes an object: stores its handle, if `make()` returns one.
template <class Kind, class Handle, class Make>
splat_result create(Handle* handle, const char* argument, Make&& make) {
    return guarded([&]() -> Status {
        SPLAT_TRY(require(handle, argument));
        SPLAT_ASSIGN(auto object, make());
        *handle = Kind::add(std::move(object));
        return {};
    });
}

/// An entry point that makes an object of a live one, `source`: stores its handle, if `make(source)`
/// returns one. Nothing is locked when it does: if add() throws, the object is destroyed, which locks.
template <class Source, class Kind, class From, class Handle, class Make>
splat_result create_of(From source, const char* source_argument, Handle* handle,
                       const char* argument, Make&& make) {
    return with<Source>(source, source_argument, [&](const auto& from) -> Status {
        SPLAT_TRY(require(handle, argument));
        SPLAT_ASSIGN(auto object, typename Kind::Made(make(from)));
        *handle = Kind::add(std::move(object));
        return {};
    });
}

/// An entry point that fills a struct of a live object: `body(object)` returns it, or a Result of it.
template <class Kind, class Handle, class Info, class Body>
splat_result describe(Handle handle, const char* argument, Info* info, const char* info_argument,
                      Body&& body) {
    return guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, Kind::find(handle, argument));
        SPLAT_TRY(check_fill(info, info_argument));
        SPLAT_ASSIGN(const Info filled, Result<Info>(body(*object)));
        give(filled, info);
        return {};
    });
}

/// An entry point that gives a text of a live object: `text(object)` returns it, or a Result of it.
template <class Kind, class Handle, class Text>
splat_result report(Handle handle, const char* argument, char* buffer, std::size_t capacity,
                    std::size_t* needed, Text&& text) {
    return guarded_text(buffer, capacity, needed, [&](auto give) -> Status {
        SPLAT_ASSIGN(const auto object, Kind::find(handle, argument));
        SPLAT_ASSIGN(const std::string made, Result<std::string>(text(*object)));
        return give(made);
    });
}

/// Remove a handle: the body of splat_*_destroy. The object lives on while others need it.
template <class Kind, class Handle>
splat_result destroy(Handle handle, const char* argument) {
    return guarded([&] { return Kind::remove(handle, argument).status(); });
}

/// A live rasterizer's live state; NULL: its default state. Errors: those of Handles::find();
/// kInvalidArgument for a state of another rasterizer.
Result<std::shared_ptr<RasterStateObject>> find_state(splat_rasterizer rasterizer,
                                                      splat_raster_state state);

/// Live weights, whose file must not have changed. Errors: Handles::find(),
/// NamedTensors::unchanged().
Result<std::shared_ptr<WeightsObject>> weights_to_use(splat_weights weights, const char* argument);

}  // namespace splat::api
