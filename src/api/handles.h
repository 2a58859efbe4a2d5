#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "api/api_guard.h"
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

/// Base of the objects of a device. Keeps the device open until their other members are destroyed.
struct OfDevice {
    explicit OfDevice(std::shared_ptr<vk::Context> owner) : context(std::move(owner)) {}
    std::shared_ptr<vk::Context> context;
};

/// A member of such an object, destroyed under the context's mutex. Nothing in it may lock that
/// mutex.
template <class Part>
class OnDevice : public Part {
  public:
    explicit OnDevice(const OfDevice& object) : context_(*object.context) {}
    OnDevice(const OnDevice&) = delete;
    OnDevice& operator=(const OnDevice&) = delete;
    ~OnDevice() {
        const std::lock_guard lock(context_.mutex);
        static_cast<Part&>(*this) = Part();
    }
    using Part::operator=;

  private:
    vk::Context& context_;
};

/// The object behind splat_device.
using DeviceObject = OfDevice;

/// The object behind splat_tensor: row-major elements on the device.
struct TensorObject : OfDevice {
    using OfDevice::OfDevice;
    std::string name;
    splat_dtype dtype = SPLAT_DTYPE_F32;
    OnDevice<vk::Buffer> buffer{*this};
    vk::BufferView view;
    splat_access mapped = 0;             ///< 0 while not mapped
    std::vector<std::byte> mapped_copy;  ///< where device memory is not host-visible

    [[nodiscard]] std::uint64_t bytes() const { return view.shape.elements() * 4; }
};

/// The object behind splat_op.
struct OpObject : OfDevice {
    using OfDevice::OfDevice;
    std::vector<std::shared_ptr<TensorObject>> tensors;  ///< destroyed after `op`
    OnDevice<std::unique_ptr<nn::OpInstance>> op{*this};
};

/// A copy of a scene on a device, activated and packed with the bands up to a degree. Never
/// changes.
struct SceneCopy : OfDevice {
    using OfDevice::OfDevice;
    std::uint32_t sh_degree = 0;
    OnDevice<raster::PackedBuffers> buffers{*this};
    raster::PackedGaussians packed;  ///< the buffers; no other copy in the process has its version
};

/// The object behind splat_scene. Its mutex is locked before that of a context, never after.
struct SceneObject {
    std::mutex mutex;
    scene::Gaussians gaussians;
    std::string report = "{}";                       ///< JSON
    std::vector<std::shared_ptr<SceneCopy>> copies;  ///< of the current Gaussians
};

/// The object behind splat_rasterizer.
struct RasterizerObject : OfDevice {
    using OfDevice::OfDevice;
    std::shared_ptr<SceneCopy> scene;  ///< the one that recorded command lists may name
    /// The Gaussians of a forward call from tensors; empty before the first such call.
    OnDevice<raster::PackedBuffers> inputs{*this};
    OnDevice<raster::PackedBuffers> grad_gaussians{*this};
    OnDevice<vk::Buffer> grad_image{*this};  ///< [V,H,W] quads
    OnDevice<vk::Buffer> grad_depth{*this};  ///< [V,H,W]
    OnDevice<std::unique_ptr<raster::Rasterizer>> rasterizer{*this};
};

/// The object behind splat_weights. Never changes.
struct WeightsObject {
    io::WeightsFile file;
    std::string report;  ///< JSON
};

/// The object behind splat_dataset. Thread-safe.
struct DatasetObject {
    std::unique_ptr<data::Dataset> dataset;
    std::string report;  ///< JSON
};

/// The text of splat_weights_report; `format` says where the weights come from.
std::string weights_report(const io::WeightsFile& file, const char* format);

/// The object behind splat_model.
struct ModelObject : OfDevice {
    using OfDevice::OfDevice;
    std::uint32_t objects = 1;                                     ///< of a batch
    OnDevice<std::shared_ptr<model::Predictor>> predictor{*this};  ///< its own, or a trainer's
    model::LoadReport load;                                        ///< of the latest load
    bool ran = false;
    bool has_input_gradients = false;  ///< input gradients are valid
};

/// The object behind splat_module.
struct ModuleObject : OfDevice {
    using OfDevice::OfDevice;
    OnDevice<std::unique_ptr<model::Module>> module{*this};
};

/// The precision in a desc's `field`; 0: balanced. Errors: kInvalidArgument.
Result<model::Precision> precision_of(splat_precision precision, const char* field);

/// The object behind splat_trainer.
struct TrainerObject : OfDevice {
    using OfDevice::OfDevice;
    OnDevice<std::shared_ptr<train::Trainer>> trainer{*this};
};

/// The object behind splat_lpips.
struct LpipsObject : OfDevice {
    using OfDevice::OfDevice;
    std::uint32_t side = 0;
    OnDevice<std::unique_ptr<model::LpipsNet>> net{*this};
};

/// Live handles. A handle is a number that is used once, so a stale or foreign one is recognised
/// and never followed.
///
/// Errors: kInvalidHandle, naming `argument`; kOutOfHostMemory by exception.
template <class Object, class Handle>
struct Handles {
    static Handle add(std::shared_ptr<Object> object);
    static Result<std::shared_ptr<Object>> find(Handle handle, const char* argument);
    /// Accepts NULL, for which the pointer is empty.
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

/// Lock the device of a live handle's object and call `body(object)`.
template <class Kind, class Handle, class Body>
Status use(Handle handle, const char* argument, Body&& body) {
    SPLAT_ASSIGN(const auto object, Kind::find(handle, argument));
    const std::lock_guard lock(object->context->mutex);
    return body(*object);
}

/// Remove a handle: the body of splat_*_destroy. The object lives on while others need it.
template <class Kind, class Handle>
splat_result destroy(Handle handle, const char* argument) {
    return guarded([&] { return Kind::remove(handle, argument).status(); });
}

/// Live weights, whose file must not have changed. Errors: Handles::find(),
/// NamedTensors::unchanged().
Result<std::shared_ptr<WeightsObject>> weights_to_use(splat_weights weights, const char* argument);

}  // namespace splat::api
