#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "data/dataset.h"
#include "io/weights_file.h"
#include "model/lpips_net.h"
#include "model/module.h"
#include "model/weights.h"
#include "nn/op_instance.h"
#include "raster/pack.h"
#include "splat.h"
#include "train/trainer.h"
#include "vk/context.h"

namespace splat::api {

/// What stands behind splat_device.
struct DeviceObject {
    std::shared_ptr<vk::Context> context;
};

/// What stands behind splat_tensor: row-major elements on the device.
struct TensorObject {
    std::shared_ptr<vk::Context> context;  ///< keeps the device open; destroyed after `buffer`
    std::string name;
    splat_dtype dtype = SPLAT_DTYPE_F32;
    vk::Buffer buffer;
    vk::BufferView view;
    splat_access mapped = 0;             ///< 0 while not mapped
    std::vector<std::byte> mapped_copy;  ///< where device memory is not host-visible

    ~TensorObject();
    [[nodiscard]] std::uint64_t bytes() const { return view.shape.elements() * 4; }
};

/// What stands behind splat_op.
struct OpObject {
    std::shared_ptr<vk::Context> context;
    std::vector<std::shared_ptr<TensorObject>> tensors;
    std::unique_ptr<nn::OpInstance> op;

    ~OpObject();
};

/// A scene on a device, activated and packed with the bands up to a degree. Never changes.
struct PackedScene {
    std::shared_ptr<vk::Context> context;
    std::uint32_t sh_degree = 0;
    std::uint32_t bands = 0;    ///< degree of the scene itself; those above are zeros
    std::uint64_t version = 0;  ///< of no other PackedScene of the process
    raster::PackedArrays arrays;

    ~PackedScene();
};

/// What stands behind splat_scene. Its mutex is locked before that of a context, never after.
struct SceneObject {
    std::mutex mutex;
    scene::Gaussians gaussians;
    std::string report = "{}";                         ///< JSON
    std::vector<std::shared_ptr<PackedScene>> packed;  ///< of the Gaussians as they are
};

/// What stands behind splat_rasterizer.
struct RasterizerObject {
    std::shared_ptr<vk::Context> context;
    std::unique_ptr<raster::Rasterizer> rasterizer;
    raster::PackedArrays inputs;  ///< of tensors; empty before the first such call
    raster::PackedArrays gradients;
    vk::Buffer grad_image;               ///< [V,H,W] quads
    vk::Buffer grad_depth;               ///< [V,H,W]
    std::shared_ptr<PackedScene> scene;  ///< the one that recorded command lists may name

    ~RasterizerObject();
};

/// What stands behind splat_weights. Never changes.
struct WeightsObject {
    io::WeightsFile file;
    std::string report;  ///< JSON
};

/// What stands behind splat_dataset. Thread-safe.
struct DatasetObject {
    std::unique_ptr<data::Dataset> dataset;
    std::string report;  ///< JSON
};

/// What splat_weights_report gives; `format` says where the weights come from.
std::string weights_report(const io::WeightsFile& file, const char* format);

/// What stands behind splat_model.
struct ModelObject {
    std::shared_ptr<vk::Context> context;
    std::uint32_t objects = 1;                    ///< of a batch
    std::shared_ptr<model::Predictor> predictor;  ///< its own, or a trainer's
    model::LoadReport load;                       ///< of the latest load
    bool ran = false;
    bool went_back = false;  ///< gradients of inputs are there

    ~ModelObject();
};

/// What stands behind splat_module.
struct ModuleObject {
    std::shared_ptr<vk::Context> context;
    std::unique_ptr<model::Module> module;

    ~ModuleObject();
};

/// SPLAT_PRECISION_* of a desc's `field`. Errors: kInvalidArgument.
Result<model::Precision> precision_of(std::int32_t precision, const char* field);

/// What stands behind splat_trainer.
struct TrainerObject {
    std::shared_ptr<vk::Context> context;
    std::shared_ptr<train::Trainer> trainer;

    ~TrainerObject();
};

/// What stands behind splat_lpips.
struct LpipsObject {
    std::shared_ptr<vk::Context> context;
    std::uint32_t side = 0;
    std::unique_ptr<model::LpipsNet> net;

    ~LpipsObject();
};

/// Live handles. A handle is a number that is never given twice, so a stale or foreign one is
/// recognised, not followed.
///
/// Errors: kInvalidHandle, naming `argument`; kOutOfHostMemory by exception.
template <class Object, class Handle>
struct Handles {
    static Handle add(std::shared_ptr<Object> object);
    static Result<std::shared_ptr<Object>> find(Handle handle, const char* argument);
    /// Also takes NULL, which gives an empty pointer.
    static Result<std::shared_ptr<Object>> remove(Handle handle, const char* argument);
};

using Devices = Handles<DeviceObject, splat_device>;
using Tensors = Handles<TensorObject, splat_tensor>;
using Ops = Handles<OpObject, splat_op>;
using Scenes = Handles<SceneObject, splat_scene>;
using Rasterizers = Handles<RasterizerObject, splat_rasterizer>;
using Weights = Handles<WeightsObject, splat_weights>;
using Datasets = Handles<DatasetObject, splat_dataset>;
using Models = Handles<ModelObject, splat_model>;
using Modules = Handles<ModuleObject, splat_module>;
using Trainers = Handles<TrainerObject, splat_trainer>;
using Lpipses = Handles<LpipsObject, splat_lpips>;

extern template struct Handles<DeviceObject, splat_device>;
extern template struct Handles<TensorObject, splat_tensor>;
extern template struct Handles<OpObject, splat_op>;
extern template struct Handles<SceneObject, splat_scene>;
extern template struct Handles<RasterizerObject, splat_rasterizer>;
extern template struct Handles<WeightsObject, splat_weights>;
extern template struct Handles<DatasetObject, splat_dataset>;
extern template struct Handles<ModelObject, splat_model>;
extern template struct Handles<ModuleObject, splat_module>;
extern template struct Handles<TrainerObject, splat_trainer>;
extern template struct Handles<LpipsObject, splat_lpips>;

/// Live weights whose values are to be used now. Errors: as Handles::find(), NamedTensors::unchanged().
Result<std::shared_ptr<WeightsObject>> weights_to_use(splat_weights weights, const char* argument);

}  // namespace splat::api
