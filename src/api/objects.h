#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "api/api_guard.h"
#include "api/core/device_object.h"
#include "api/priors/prior_model_object.h"
#include "data/dataset.h"
#include "eval/compare_scores.h"
#include "eval/evaluator.h"
#include "fit/fit_task.h"
#include "gaussians/gaussian_set.h"
#include "io/weights_file.h"
#include "model/lpips_net.h"
#include "model/module.h"
#include "model/weights.h"
#include "nn/op_instance.h"
#include "predict/predictor.h"
#include "raster/rasterizer.h"
#include "run/run.h"
#include "splat.h"
#include "train/batches.h"
#include "train/optimiser.h"
#include "train/trainer.h"

namespace splat::api {

/// The object behind splat_tensor: row-major elements on the device.
struct TensorObject : OfDevice {
    using OfDevice::OfDevice;
    ~TensorObject() {
        end_mapping();
        if (!exposed) return;
        written();
        --use->exposed;
    }
    std::string name;
    splat_dtype dtype = SPLAT_DTYPE_F32;
    OnDevice<vk::Buffer> buffer{*this};  ///< empty if `owner` has the memory
    vk::BufferView view;
    std::shared_ptr<void> owner;           ///< a model
    std::shared_ptr<vk::OutsideUse> use;   ///< what the owner must know; else nullptr
    std::atomic<splat_access> mapped = 0;  ///< 0 while not mapped; changes under the mutex
    std::vector<std::byte> mapped_copy;    ///< where device memory is not host-visible
    std::atomic<bool> exposed = false;     ///< a pointer was given away, and `use` knows it

    [[nodiscard]] std::uint64_t bytes() const { return view.shape.elements() * 4; }

    /// Call for each call of the library that writes the elements.
    void written() const {
        if (use != nullptr) ++use->writes;
    }
    /// Call when a pointer is given away through which others may write while the tensor lives.
    void expose() {
        if (use != nullptr && !exposed.exchange(true)) ++use->exposed;
    }
    void begin_mapping(splat_access access) {
        if (use != nullptr) use->map(view);
        mapped = access;
    }
    void end_mapping() {
        if (mapped == 0) return;
        if (mapped != SPLAT_ACCESS_READ) written();
        if (use != nullptr) use->unmap(view);
        mapped = 0;
    }
};

/// The object behind splat_op.
struct OpObject : OfDevice {
    using OfDevice::OfDevice;
    std::vector<std::shared_ptr<TensorObject>> tensors;               ///< destroyed after `op`
    std::vector<std::shared_ptr<TensorObject>> outputs, grad_inputs;  ///< written by passes
    OnDevice<std::unique_ptr<nn::OpInstance>> op{*this};
};

/// A copy of a scene on a device, with the bands up to a degree. Never changes.
struct SceneCopy : OfDevice {
    using OfDevice::OfDevice;
    OnDevice<gaussians::GaussianSet> set{*this};
};

/// The object behind splat_scene. A context's mutex is locked before that of a scene, never after. Calls
/// that only read the Gaussians hold it shared, so that they do not wait for one another.
struct SceneObject {
    ForkMutex mutex;
    scene::Gaussians gaussians;
    std::string report = "{}";  ///< JSON
    /// Hold the current Gaussians. To change them, hold `mutex`, or share it and hold `copies_mutex`.
    std::vector<std::shared_ptr<SceneCopy>> copies;
    ForkMutex copies_mutex;
    std::atomic<bool> warned = false;  ///< about a rasterizer whose flags lack some of `drawn_as`
};

/// Gradients of one backward call, in the kernels' layout. The states of a rasterizer share them.
struct RasterGradients : OfDevice {
    using OfDevice::OfDevice;
    OnDevice<gaussians::GaussianSet> gaussians{*this};
    OnDevice<vk::Buffer> image{*this};  ///< [V,H,W] quads
    OnDevice<vk::Buffer> depth{*this};  ///< [V,H,W]

    [[nodiscard]] std::uint64_t bytes() const {
        return gaussians.bytes() + image.bytes() + depth.bytes();
    }
};

/// The object behind splat_raster_state: a forward call, and what its backward call needs.
struct RasterStateObject : OfDevice {
    using OfDevice::OfDevice;
    std::shared_ptr<RasterGradients> gradients;  ///< shared with its rasterizer
    std::shared_ptr<SceneCopy> scene;            ///< named by recorded command lists
    /// The Gaussians of a forward call from tensors; empty before the first such call.
    OnDevice<gaussians::GaussianSet> inputs{*this};
    OnDevice<std::unique_ptr<raster::Rasterizer>> rasterizer{*this};
    bool any_views = false;       ///< a call with more makes `rasterizer` anew
    bool linear_colors = false;   ///< images are converted to sRGB
    std::uint32_t gaussians = 0;  ///< most of a scene; more than the device takes: in bands
    Published<splat_rasterizer_info> info;  ///< describes the latest call

    /// Set `info`. The context's mutex is held.
    void describe();
};

/// The object behind splat_rasterizer.
struct RasterizerObject : OfDevice {
    using OfDevice::OfDevice;
    raster::RasterDesc desc;      ///< capacities at first
    std::uint32_t gaussians = 0;  ///< see RasterStateObject, as for the next
    bool any_views = false, linear_colors = false;
    std::shared_ptr<RasterGradients> gradients;        ///< without memory unless desc.backward
    std::shared_ptr<RasterStateObject> default_state;  ///< used by calls without a state
};

/// The object behind splat_weights. Never changes.
struct WeightsObject {
    io::WeightsFile file;
    std::string from;  ///< the report's "format"
    std::string path;  ///< empty for weights of no file
};

/// The object behind splat_dataset. Thread-safe.
struct DatasetObject {
    std::unique_ptr<data::Dataset> dataset;
    std::string report;  ///< JSON
};

/// The object's data set, which keeps the object alive.
inline std::shared_ptr<data::Dataset> dataset_of(const std::shared_ptr<DatasetObject>& object) {
    return {object, object->dataset.get()};
}

/// The object behind splat_model.
struct ModelObject : OfDevice {
    using OfDevice::OfDevice;
    std::uint32_t objects = 1;                             ///< objects per batch
    std::uint32_t flags = 0;                               ///< SPLAT_MODEL_ bits
    OnDevice<std::shared_ptr<model::Model>> model{*this};  ///< the model's or a trainer's
    Published<model::LoadReport> load;                     ///< report of the latest load
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

/// The object behind splat_predictor. Only the predictor changes.
struct PredictorObject : OfDevice {
    using OfDevice::OfDevice;
    config::Settings settings;
    std::string path, report;  ///< where weights lie, empty for a handle; JSON
    predict::Aggregation aggregation;
    OnDevice<std::unique_ptr<predict::Predictor>> predictor{*this};
};

/// The object behind splat_trainer.
struct TrainerObject : OfDevice {
    using OfDevice::OfDevice;
    OnDevice<std::shared_ptr<train::Trainer>> trainer{*this};
    struct Counters {
        std::uint64_t steps = 0, attempts = 0, unread = 0, skipped = 0;
    };
    Published<Counters> counters;  ///< counters of the trainer
};

/// The object behind splat_optimizer.
struct OptimizerObject : OfDevice {
    using OfDevice::OfDevice;
    // What it updates; destroyed after `optimiser`.
    std::vector<std::shared_ptr<ModelObject>> models;
    std::vector<std::shared_ptr<ModuleObject>> modules;
    std::vector<std::shared_ptr<TensorObject>> tensors;  ///< parameters and gradients
    train::OptimiserStep last;
    bool stepped = false;  ///< `last` is of a step
    OnDevice<std::unique_ptr<train::Optimiser>> optimiser{*this};
    std::mutex info_mutex;  ///< locked for moments only
    splat_optimizer_info info{};
};

/// The object behind splat_batches.
struct BatchesObject {
    train::PrefetchPointer source;
    std::uint32_t channels = 0, objects = 0;
    train::Batch batch;  ///< batch of the latest call, with its targets as floats and its cameras
    std::vector<float> targets;
    std::vector<splat_camera> cameras;
};

/// The object behind splat_run, which locks its device itself.
struct RunObject : OfDevice {
    using OfDevice::OfDevice;
    Interrupt interrupt;
    std::shared_ptr<run::Group> group;        ///< null: no other ranks
    std::unique_ptr<run::Work> run;           ///< destroyed before `interrupt` and `group`
    std::shared_ptr<train::Trainer> trainer;  ///< trainer of a training
    fit::FitTask* fit = nullptr;              ///< task of a fit, which `run` owns
    run::Event event;                         ///< event of the latest call
    std::vector<splat_number> numbers;        ///< numbers of that event
    Published<run::Figures> figures;          ///< after that call
};

/// The object behind splat_lpips.
struct LpipsObject : OfDevice {
    using OfDevice::OfDevice;
    std::uint32_t side = 0;
    OnDevice<std::unique_ptr<model::LpipsNet>> net{*this};
};

/// The object behind splat_evaluator. It locks devices itself.
struct EvaluatorObject {
    std::shared_ptr<PredictorObject> predictor;  ///< nullptr without one, like the next
    std::shared_ptr<LpipsObject> lpips;
    std::unique_ptr<eval::Evaluator> evaluator;  ///< destroyed before them
};

/// The object behind splat_comparison. Never changes.
struct ComparisonObject {
    eval::ScoreComparison comparison;
};

}  // namespace splat::api
