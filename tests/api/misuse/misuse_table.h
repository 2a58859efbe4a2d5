#pragma once

#include <functional>

#include "api/raster_calls.h"

namespace splat::test {

inline constexpr splat_result kArgument = SPLAT_ERROR_INVALID_ARGUMENT;
inline constexpr splat_result kHandle = SPLAT_ERROR_INVALID_HANDLE;
inline constexpr splat_result kState = SPLAT_ERROR_INVALID_STATE;
inline constexpr splat_result kNotFound = SPLAT_ERROR_NOT_FOUND;
inline constexpr splat_result kFormat = SPLAT_ERROR_FORMAT;

/// One wrong (or barely right) way to call a function of the header.
struct Misuse {
    std::string function;
    std::string parameter;  ///< the wrong parameter; "" for a function without parameters
    std::string what;
    splat_result expected;
    std::function<splat_result()> call;
};

/// Outputs of the calls. A failed call leaves them unchanged.
struct Outputs {
    Outputs();
    [[nodiscard]] bool untouched() const;

    Output<splat_device> device;
    Output<splat_tensor> tensor;
    Output<splat_op> op;
    Output<splat_scene> scene;
    Output<splat_rasterizer> rasterizer;
    Output<splat_raster_state> state;
    Output<splat_weights> weights;
    Output<splat_model> model;
    Output<splat_model_info> model_info;
    Output<splat_port> port;
    Output<splat_module> module;
    Output<splat_evaluator> evaluator;
    Output<splat_evaluator_info> evaluator_info;
    Output<splat_object_scores> object_scores;
    Output<splat_evaluation_summary> summary;
    Output<splat_comparison> comparison;
    Output<splat_comparison_info> comparison_info;
    Output<splat_metric_comparison> metric;
    Output<splat_predictor> predictor;
    Output<splat_predictor_info> predictor_info;
    Output<splat_picture_info> picture_info;
    Output<splat_trainer> trainer;
    Output<splat_trainer_info> trainer_info;
    Output<splat_optimizer> optimizer;
    Output<splat_optimizer_info> optimizer_info;
    Output<splat_lpips> lpips;
    Output<splat_prior_model> prior_model;
    Output<double> distance;
    Output<splat_image_scores> image_scores;
    Output<splat_depth_scores> depth_scores;
    Output<splat_normal_scores> normal_scores;
    Output<splat_mask_scores> mask_scores;
    Output<splat_fidelity_scores> fidelity_scores;
    Output<splat_point_scores> point_scores;
    Output<splat_dataset> dataset;
    Output<splat_batches> batches;
    Output<splat_training> training;
    Output<splat_weights_info> weights_info;
    Output<splat_camera> camera;
    Output<splat_scene_info> scene_info;
    Output<splat_rasterizer_info> rasterizer_info;
    Output<splat_device_info> device_info;
    Output<splat_memory_info> memory;
    Output<splat_tensor_info> tensor_info;
    Output<splat_tensor_stats> stats;
    Output<float[16]> values;
    Output<char[16]> text;
    Output<std::size_t> size;
    Output<std::uint32_t> count;
    Output<void*> pointer;
    Output<DLManagedTensorVersioned*> dlpack;
};

/// Live and destroyed objects for the calls.
class MisuseTable {
  public:
    MisuseTable();
    [[nodiscard]] const std::vector<Misuse>& rows() const { return rows_; }

    Outputs outputs;

  private:
    void library_rows();
    void device_rows();
    void device_text_rows();
    void device_desc_rows();
    void tensor_create_rows();
    void tensor_copy_rows();
    void tensor_rows();
    void op_rows();
    void op_desc_rows();
    void scene_rows();
    void scene_file_rows();
    void scene_change_rows();
    void camera_rows();
    void camera_file_rows();
    void rasterizer_rows();
    void rasterizer_forward_rows();
    void rasterizer_output_rows();
    void rasterizer_image_rows();
    void raster_state_rows();
    void scene_render_rows();
    void image_rows();
    void image_memory_rows();
    void weights_memory_rows();
    void camera_memory_rows();
    void camera_save_rows();
    void trainer_memory_rows();
    void weights_rows();
    void fold_rows();
    void dataset_rows();
    void synthetic_rows();
    void co3d_rows();
    void table_rows();
    void model_rows();
    void model_state_rows();
    void model_pass_rows();
    void model_tensor_rows();
    void module_rows();
    void module_tensor_rows();
    void config_rows();
    void trainer_rows();
    void trainer_step_rows();
    void batches_rows();
    void training_rows();
    void training_desc_rows();
    void picture_rows();
    void predictor_rows();
    void evaluator_rows();
    void evaluator_load_rows();
    void evaluator_score_rows();
    void comparison_rows();
    void prediction_rows();
    void optimizer_rows();
    void optimizer_desc_rows();
    void image_score_rows();
    void lpips_rows();
    void prior_score_rows();
    void prior_flag_rows();
    void prior_filter_rows();
    void point_rows();
    void scene_point_rows();
    void prior_rows();
    void normals_rows();
    void prior_model_rows();

    template <class Handle>
    static std::uintptr_t number(Handle handle) {
        return reinterpret_cast<std::uintptr_t>(handle);
    }

    [[nodiscard]] Optimizer make_optimizer(const splat_optimizer_item& item) const;
    void add(const char* function, const char* parameter, const char* what, splat_result expected,
             std::function<splat_result()> call);
    /// All invalid handles of the kind: NULL, destroyed, of other kinds, never created.
    template <class Handle>
    void handles(const char* function, const char* parameter,
                 std::function<splat_result(Handle)> call, splat_result for_null);
    /// An info or stats struct: NULL, and sizes of no version.
    template <class Info>
    void infos(const char* function, const char* parameter,
               std::function<splat_result(Info*)> call);
    /// A desc: the same, unknown flags, and a next that is not NULL.
    template <class Desc>
    void descs(const char* function, const Desc& good,
               std::function<splat_result(const Desc*)> call);

    Device device_ = open_device(SPLAT_DEVICE_PROFILE);
    Tensor tensor_ = make_tensor(device_, {4}, "mine");
    Tensor matrix_ = make_tensor(device_, {2, 2});
    Tensor result_ = make_tensor(device_, {2, 2});
    OpRequest request_{"linear", {matrix_, matrix_, nullptr}, {result_}};
    Op op_ = make_op(device_, request_);
    Scene scene_ = SampleScene(3).create();
    Rasterizer rasterizer_ =
        make_rasterizer(device_, rasterizer_desc(3, 16, 16, SPLAT_RASTERIZER_BACKWARD, 1));
    Rasterizer drawn_ = make_rasterizer(device_, rasterizer_desc(3, 16, 16));
    RasterState state_ = make_state(rasterizer_);
    /// Belongs to another rasterizer.
    RasterState foreign_state_ = make_state(make_rasterizer(device_, rasterizer_desc(3, 16, 16)));
    Weights weights_ = make_weights();
    splat_weights weights_handle_ = weights_.get();  ///< handle that descs point to
    Model model_ = make_model(device_);
    Module module_ = make_module(device_);
    Predictor predictor_ = make_predictor(device_);
    Trainer trainer_ = make_trainer(device_);
    splat_optimizer_item item_{"mine", nullptr, nullptr, matrix_, result_};
    Optimizer optimizer_ = make_optimizer(item_);
    Dataset dataset_ = make_dataset();
    Batches batches_ = make_batches();
    Training training_ = make_training(device_);
    Evaluator evaluator_ = make_evaluator(dataset_);
    Comparison comparison_ = make_comparison();
    std::uintptr_t stale_device_ = 0;
    std::uintptr_t stale_tensor_ = 0;
    std::uintptr_t stale_op_ = 0;
    std::uintptr_t stale_scene_ = 0;
    std::uintptr_t stale_rasterizer_ = 0;
    std::uintptr_t stale_state_ = 0;
    std::uintptr_t stale_weights_ = 0;
    std::uintptr_t stale_model_ = 0;
    std::uintptr_t stale_module_ = 0;
    std::uintptr_t stale_predictor_ = 0;
    std::uintptr_t stale_evaluator_ = 0;
    std::uintptr_t stale_comparison_ = 0;
    std::uintptr_t stale_trainer_ = 0;
    std::uintptr_t stale_optimizer_ = 0;
    std::uintptr_t stale_dataset_ = 0;
    std::uintptr_t stale_batches_ = 0;
    std::uintptr_t stale_training_ = 0;
    std::vector<Misuse> rows_;
};

/// A struct as a later version of the library may have it.
template <class Known>
struct Later {
    Known known;
    std::uint64_t added[2];
};

template <class Handle>
void MisuseTable::handles(const char* function, const char* parameter,
                          std::function<splat_result(Handle)> call, splat_result for_null) {
    add(function, parameter, "NULL", for_null, [call] { return call(nullptr); });
    constexpr bool device = std::is_same_v<Handle, splat_device>;
    constexpr bool tensor = std::is_same_v<Handle, splat_tensor>;
    constexpr bool op = std::is_same_v<Handle, splat_op>;
    constexpr bool scene = std::is_same_v<Handle, splat_scene>;
    constexpr bool rasterizer = std::is_same_v<Handle, splat_rasterizer>;
    constexpr bool state = std::is_same_v<Handle, splat_raster_state>;
    constexpr bool weights = std::is_same_v<Handle, splat_weights>;
    constexpr bool model = std::is_same_v<Handle, splat_model>;
    constexpr bool module = std::is_same_v<Handle, splat_module>;
    constexpr bool predictor = std::is_same_v<Handle, splat_predictor>;
    constexpr bool evaluator = std::is_same_v<Handle, splat_evaluator>;
    constexpr bool comparison = std::is_same_v<Handle, splat_comparison>;
    constexpr bool trainer = std::is_same_v<Handle, splat_trainer>;
    constexpr bool optimizer = std::is_same_v<Handle, splat_optimizer>;
    constexpr bool dataset = std::is_same_v<Handle, splat_dataset>;
    constexpr bool batches = std::is_same_v<Handle, splat_batches>;
    constexpr bool training = std::is_same_v<Handle, splat_training>;
    const auto bad = [&](const char* what, std::uintptr_t key) {
        add(function, parameter, what, SPLAT_ERROR_INVALID_HANDLE,
            [call, key] { return call(reinterpret_cast<Handle>(key)); });
    };
    if (!device) bad("a device", number(device_.get()));
    if (!tensor) bad("a tensor", number(tensor_.get()));
    if (!op) bad("an operator", number(op_.get()));
    if (!scene) bad("a scene", number(scene_.get()));
    if (!rasterizer) bad("a rasterizer", number(rasterizer_.get()));
    if (!state) bad("a state", number(state_.get()));
    if (!weights) bad("weights", number(weights_.get()));
    if (!model) bad("a model", number(model_.get()));
    if (!module) bad("a module", number(module_.get()));
    if (!predictor) bad("a predictor", number(predictor_.get()));
    if (!evaluator) bad("an evaluator", number(evaluator_.get()));
    if (!comparison) bad("a comparison", number(comparison_.get()));
    if (!trainer) bad("a trainer", number(trainer_.get()));
    if (!optimizer) bad("an optimizer", number(optimizer_.get()));
    if (!dataset) bad("a data set", number(dataset_.get()));
    if (!batches) bad("batches", number(batches_.get()));
    if (!training) bad("a training", number(training_.get()));
    bad("a destroyed device", stale_device_);
    bad("a destroyed tensor", stale_tensor_);
    bad("a destroyed operator", stale_op_);
    bad("a destroyed scene", stale_scene_);
    bad("a destroyed rasterizer", stale_rasterizer_);
    bad("a destroyed state", stale_state_);
    bad("destroyed weights", stale_weights_);
    bad("a destroyed model", stale_model_);
    bad("a destroyed module", stale_module_);
    bad("a destroyed predictor", stale_predictor_);
    bad("a destroyed evaluator", stale_evaluator_);
    bad("a destroyed comparison", stale_comparison_);
    bad("a destroyed trainer", stale_trainer_);
    bad("a destroyed optimizer", stale_optimizer_);
    bad("a destroyed data set", stale_dataset_);
    bad("destroyed batches", stale_batches_);
    bad("a destroyed training", stale_training_);
    bad("a small number", 1);
    bad("an address", number(&rows_));
    bad("all ones", ~std::uintptr_t{0});
    bad("a handle not yet given", number(op_.get()) + (1U << 20));
}

template <class Info>
void MisuseTable::infos(const char* function, const char* parameter,
                        std::function<splat_result(Info*)> call) {
    add(function, parameter, "NULL", SPLAT_ERROR_INVALID_ARGUMENT,
        [call] { return call(nullptr); });
    for (const std::size_t size : {std::size_t{0}, std::size_t{4}, sizeof(Info) - 1})
        add(function, parameter, "a struct_size of no version", SPLAT_ERROR_INVALID_ARGUMENT,
            [call, size] {
                Output<Info> info;
                info.set_struct_size(static_cast<std::uint32_t>(size));
                const splat_result result = call(info.out());
                return info.untouched() ? result : SPLAT_ERROR_INTERNAL;
            });
    add(function, parameter, "a struct_size beyond all versions", SPLAT_ERROR_INVALID_ARGUMENT,
        [call] {
            Output<Info> info;
            info.set_struct_size(0x7FFFFFFFU);
            return call(info.out());
        });
}

template <class Desc>
void MisuseTable::descs(const char* function, const Desc& good,
                        std::function<splat_result(const Desc*)> call) {
    const auto invalid = [&](const char* what, void (*change)(Desc&)) {
        Desc desc = good;
        change(desc);
        add(function, "desc", what, SPLAT_ERROR_INVALID_ARGUMENT,
            [call, desc] { return call(&desc); });
    };
    invalid("struct_size 0", [](Desc& desc) { desc.struct_size = 0; });
    invalid("struct_size beyond all versions", [](Desc& desc) { desc.struct_size = 0x7FFFFFFFU; });
    const Later<Desc> later = {good, {0, 1}};
    add(function, "desc", "a member of a later version", SPLAT_ERROR_UNSUPPORTED, [call, later] {
        Later<Desc> given = later;
        given.known.struct_size = sizeof given;
        return call(&given.known);
    });
    invalid("struct_size cut", [](Desc& desc) { desc.struct_size -= 1; });
    invalid("unknown flags", [](Desc& desc) { desc.flags |= 1U << 31; });
    invalid("unknown flags", [](Desc& desc) { desc.flags |= 1U << 20; });
    invalid("a next", [](Desc& desc) { desc.next = &desc; });
    if constexpr (requires { good.reserved; })
        invalid("a reserved member", [](Desc& desc) { desc.reserved = 1; });
}

}  // namespace splat::test
