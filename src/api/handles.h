#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "api/mesh/mesh_object.h"
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

// The kinds of handles: the name of the kind, the object behind a handle, the handle, the usual name of an argument.
#define SPLAT_HANDLE_KINDS(X)                      \
    X(Devices, DeviceObject, splat_device, device) \
    SPLAT_KINDS_BUT_DEVICES(X)
#define SPLAT_KINDS_BUT_DEVICES(X)                                 \
    X(Tensors, TensorObject, splat_tensor, tensor)                 \
    X(Ops, OpObject, splat_op, op)                                 \
    X(Scenes, SceneObject, splat_scene, scene)                     \
    X(Rasterizers, RasterizerObject, splat_rasterizer, rasterizer) \
    X(RasterStates, RasterStateObject, splat_raster_state, state)  \
    X(Weights, WeightsObject, splat_weights, weights)              \
    X(Datasets, DatasetObject, splat_dataset, dataset)             \
    X(Models, ModelObject, splat_model, model)                     \
    X(Modules, ModuleObject, splat_module, module)                 \
    X(Predictors, PredictorObject, splat_predictor, predictor)     \
    X(Trainers, TrainerObject, splat_trainer, trainer)             \
    X(Optimizers, OptimizerObject, splat_optimizer, optimizer)     \
    X(AllBatches, BatchesObject, splat_batches, batches)           \
    X(Runs, RunObject, splat_run, run)                             \
    X(Lpipses, LpipsObject, splat_lpips, lpips)                    \
    X(Evaluators, EvaluatorObject, splat_evaluator, evaluator)     \
    X(Comparisons, ComparisonObject, splat_comparison, comparison) \
    X(PriorModels, PriorModelObject, splat_prior_model, model)     \
    X(Meshes, MeshObject, splat_mesh, mesh)

/// The kind of a type of handles, with kArgument.
template <class Handle>
struct KindOf;

#define SPLAT_HANDLE_KIND(kind, object, handle, argument)   \
    using kind = Handles<object, handle>;                   \
    extern template struct Handles<object, handle>;         \
    template <>                                             \
    struct KindOf<handle> : kind {                          \
        static constexpr const char* kArgument = #argument; \
    };
SPLAT_HANDLE_KINDS(SPLAT_HANDLE_KIND)
#undef SPLAT_HANDLE_KIND

/// The live object of an argument with the usual name.
template <class Handle>
auto find(Handle handle) {
    return KindOf<Handle>::find(handle, KindOf<Handle>::kArgument);
}

/// An entry point that needs a live object: calls `body(object)` with the shared pointer to it.
template <class Handle, class Body>
splat_result with(Handle handle, Body&& body) {
    return guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, find(handle));
        return body(object);
    });
}

/// An entry point that needs a live object of a device: locks that and calls `body(*object)`. Errors: also kCancelled.
template <class Handle, class Body>
splat_result locked(Handle handle, Body&& body) {
    return with(handle, [&](const auto& object) -> Status {
        return object->context->mutex.call([&]() -> Status { return body(*object); });
    });
}

/// Store the handle of a new object, if `made` is one.
template <class Handle>
Status give_handle(typename KindOf<Handle>::Made made, Handle* handle) {
    SPLAT_ASSIGN(auto object, std::move(made));
    *handle = KindOf<Handle>::add(std::move(object));
    return {};
}

/// An entry point that makes an object: stores its handle, if `make()` returns one.
template <class Handle, class Make>
splat_result create(Handle* handle, const char* argument, Make&& make) {
    return guarded([&]() -> Status {
        SPLAT_TRY(require(handle, argument));
        return give_handle(make(), handle);
    });
}
template <class Handle, class Make>
splat_result create(Handle* handle, Make&& make) {
    return create(handle, KindOf<Handle>::kArgument, make);
}

/// An entry point that makes an object of a live one, `source`: stores its handle, if `make(source)`
/// returns one. Nothing is locked when it does: if add() throws, the object is destroyed, which locks.
template <class From, class Handle, class Make>
splat_result create_of(From source, Handle* handle, Make&& make) {
    return with(source, [&](const auto& from) -> Status {
        SPLAT_TRY(require(handle, KindOf<Handle>::kArgument));
        return give_handle(make(from), handle);
    });
}

/// An entry point that fills a struct of a live object: `body(object)` returns it, or a Result of it.
template <class Handle, class Info, class Body>
splat_result describe(Handle handle, Info* info, const char* info_argument, Body&& body) {
    return with(handle, [&](const auto& object) -> Status {
        SPLAT_TRY(check_fill(info, info_argument));
        SPLAT_ASSIGN(const Info filled, Result<Info>(body(*object)));
        give(filled, info);
        return {};
    });
}

/// An entry point that gives a text of a live object: `text(object)` returns it, or a Result of it.
template <class Handle, class Text>
splat_result report(Handle handle, char* buffer, std::size_t capacity, std::size_t* needed,
                    Text&& text) {
    return guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        SPLAT_ASSIGN(const auto object, find(handle));
        return text(*object);
    });
}

/// A live rasterizer's live state; NULL: its default state. Errors: those of Handles::find();
/// kInvalidArgument for a state of another rasterizer.
Result<std::shared_ptr<RasterStateObject>> find_state(splat_rasterizer rasterizer,
                                                      splat_raster_state state);

/// Live weights, whose file must not have changed. Errors: Handles::find(),
/// NamedTensors::unchanged().
Result<std::shared_ptr<WeightsObject>> weights_to_use(splat_weights weights, const char* argument);

}  // namespace splat::api
