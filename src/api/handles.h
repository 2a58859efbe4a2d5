#pragma once

#include <memory>
#include <mutex>

#include "api/objects.h"

namespace splat::api {

/// Live handles. A handle is a number that is used once, so a stale or foreign one is recognised
/// and never followed.
///
/// Errors: kInvalidHandle, naming `argument`; kInvalidState for an object of a device in a process that
/// was forked from the one that opened it; kOutOfHostMemory by exception.
template <class Object, class Handle>
struct Handles {
    static Handle add(std::shared_ptr<Object> object);
    static Result<std::shared_ptr<Object>> find(Handle handle, const char* argument);
    /// Accepts NULL, for which the pointer is empty, and objects that find() refuses after a fork.
    static Result<std::shared_ptr<Object>> remove(Handle handle, const char* argument);
    /// Raise the Interrupt of a live device, or of an object with a member `interrupt`. Atomics only.
    /// Returns false if there is none.
    static bool interrupt(Handle handle) noexcept;
};

using Devices = Handles<DeviceObject, splat_device>;
using Tensors = Handles<TensorObject, splat_tensor>;
using Ops = Handles<OpObject, splat_op>;
using Scenes = Handles<SceneObject, splat_scene>;
using Rasterizers = Handles<RasterizerObject, splat_rasterizer>;
using RasterStates = Handles<RasterStateObject, splat_raster_state>;
using Weights = Handles<WeightsObject, splat_weights>;
using Datasets = Handles<DatasetObject, splat_dataset>;
using Models = Handles<ModelObject, splat_model>;
using Modules = Handles<ModuleObject, splat_module>;
using Predictors = Handles<PredictorObject, splat_predictor>;
using Trainers = Handles<TrainerObject, splat_trainer>;
using Optimizers = Handles<OptimizerObject, splat_optimizer>;
using AllBatches = Handles<BatchesObject, splat_batches>;
using Runs = Handles<RunObject, splat_run>;
using Lpipses = Handles<LpipsObject, splat_lpips>;
using Evaluators = Handles<EvaluatorObject, splat_evaluator>;
using Comparisons = Handles<ComparisonObject, splat_comparison>;
using PriorModels = Handles<PriorModelObject, splat_prior_model>;

extern template struct Handles<DeviceObject, splat_device>;
extern template struct Handles<TensorObject, splat_tensor>;
extern template struct Handles<OpObject, splat_op>;
extern template struct Handles<SceneObject, splat_scene>;
extern template struct Handles<RasterizerObject, splat_rasterizer>;
extern template struct Handles<RasterStateObject, splat_raster_state>;
extern template struct Handles<WeightsObject, splat_weights>;
extern template struct Handles<DatasetObject, splat_dataset>;
extern template struct Handles<ModelObject, splat_model>;
extern template struct Handles<ModuleObject, splat_module>;
extern template struct Handles<PredictorObject, splat_predictor>;
extern template struct Handles<TrainerObject, splat_trainer>;
extern template struct Handles<OptimizerObject, splat_optimizer>;
extern template struct Handles<BatchesObject, splat_batches>;
extern template struct Handles<RunObject, splat_run>;
extern template struct Handles<LpipsObject, splat_lpips>;
extern template struct Handles<EvaluatorObject, splat_evaluator>;
extern template struct Handles<ComparisonObject, splat_comparison>;
extern template struct Handles<PriorModelObject, splat_prior_model>;

/// Lock the device of a live handle's object and call `body(object)`. Errors: also kCancelled.
template <class Kind, class Handle, class Body>
Status use(Handle handle, const char* argument, Body&& body) {
    SPLAT_ASSIGN(const auto object, Kind::find(handle, argument));
    const std::lock_guard lock(object->context->mutex);
    SPLAT_TRY(object->context->mutex.check());
    return body(*object);
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
