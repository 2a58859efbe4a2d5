#include "api/misuse/misuse_table.h"

namespace splat::test {

Outputs::Outputs() {
    device_info.set_struct_size(sizeof(splat_device_info));
    memory.set_struct_size(sizeof(splat_memory_info));
    tensor_info.set_struct_size(sizeof(splat_tensor_info));
    stats.set_struct_size(sizeof(splat_tensor_stats));
    scene_info.set_struct_size(sizeof(splat_scene_info));
    rasterizer_info.set_struct_size(sizeof(splat_rasterizer_info));
    weights_info.set_struct_size(sizeof(splat_weights_info));
    predictor_info.set_struct_size(sizeof(splat_predictor_info));
    model_info.set_struct_size(sizeof(splat_model_info));
    evaluator_info.set_struct_size(sizeof(splat_evaluator_info));
    object_scores.set_struct_size(sizeof(splat_object_scores));
    summary.set_struct_size(sizeof(splat_evaluation_summary));
    comparison_info.set_struct_size(sizeof(splat_comparison_info));
    metric.set_struct_size(sizeof(splat_metric_comparison));
    trainer_info.set_struct_size(sizeof(splat_trainer_info));
    optimizer_info.set_struct_size(sizeof(splat_optimizer_info));
    image_scores.set_struct_size(sizeof(splat_image_scores));
    depth_scores.set_struct_size(sizeof(splat_depth_scores));
    normal_scores.set_struct_size(sizeof(splat_normal_scores));
    mask_scores.set_struct_size(sizeof(splat_mask_scores));
    fidelity_scores.set_struct_size(sizeof(splat_fidelity_scores));
    point_scores.set_struct_size(sizeof(splat_point_scores));
}

bool Outputs::untouched() const {
    return state.untouched() && optimizer.untouched() && optimizer_info.untouched() &&
           device.untouched() && tensor.untouched() && op.untouched() && device_info.untouched() &&
           memory.untouched() && tensor_info.untouched() && stats.untouched() &&
           values.untouched() && text.untouched() && size.untouched() && count.untouched() &&
           pointer.untouched() && scene.untouched() && rasterizer.untouched() &&
           camera.untouched() && scene_info.untouched() && rasterizer_info.untouched() &&
           weights.untouched() && model.untouched() && weights_info.untouched() &&
           predictor.untouched() && predictor_info.untouched() && picture_info.untouched() &&
           trainer.untouched() && trainer_info.untouched() && image_scores.untouched() &&
           module.untouched() && dataset.untouched() && batches.untouched() &&
           training.untouched() && lpips.untouched() && prior_model.untouched() &&
           distance.untouched() && dlpack.untouched() && model_info.untouched() &&
           port.untouched() && state.untouched() && evaluator.untouched() &&
           evaluator_info.untouched() && object_scores.untouched() && summary.untouched() &&
           comparison.untouched() && comparison_info.untouched() && metric.untouched() &&
           depth_scores.untouched() && normal_scores.untouched() && mask_scores.untouched() &&
           fidelity_scores.untouched() && point_scores.untouched();
}

MisuseTable::MisuseTable() {
    const splat_camera camera = sample_camera(16, 16);
    EXPECT_DONE(splat_rasterizer_forward_scene(drawn_, nullptr, scene_, &camera, 1, nullptr));
    stale_device_ = number(open_device().destroy());
    stale_tensor_ = number(make_tensor(device_, {1}).destroy());
    stale_op_ = number(make_op(device_, request_).destroy());
    stale_scene_ = number(SampleScene(1).create().destroy());
    stale_rasterizer_ = number(make_rasterizer(device_, rasterizer_desc(1, 16, 16)).destroy());
    stale_state_ = number(make_state(rasterizer_).destroy());
    stale_weights_ = number(make_weights().destroy());
    stale_model_ = number(make_model(device_).destroy());
    stale_module_ = number(make_module(device_).destroy());
    stale_predictor_ = number(make_predictor(device_).destroy());
    stale_evaluator_ = number(make_evaluator(dataset_).destroy());
    stale_comparison_ = number(make_comparison().destroy());
    stale_trainer_ = number(make_trainer(device_).destroy());
    stale_optimizer_ = number(make_optimizer(item_).destroy());
    stale_dataset_ = number(make_dataset().destroy());
    stale_batches_ = number(make_batches().destroy());
    stale_training_ = number(make_training(device_).destroy());
    library_rows();
    device_rows();
    device_text_rows();
    device_desc_rows();
    tensor_create_rows();
    tensor_copy_rows();
    tensor_rows();
    op_rows();
    op_desc_rows();
    scene_rows();
    scene_file_rows();
    scene_change_rows();
    camera_rows();
    camera_file_rows();
    rasterizer_rows();
    rasterizer_forward_rows();
    rasterizer_output_rows();
    rasterizer_image_rows();
    raster_state_rows();
    scene_render_rows();
    image_rows();
    image_memory_rows();
    weights_memory_rows();
    camera_memory_rows();
    camera_save_rows();
    trainer_memory_rows();
    weights_rows();
    dataset_rows();
    model_rows();
    module_rows();
    config_rows();
    trainer_rows();
    batches_rows();
    training_rows();
    training_desc_rows();
    picture_rows();
    predictor_rows();
    evaluator_rows();
    evaluator_load_rows();
    evaluator_score_rows();
    comparison_rows();
    prediction_rows();
    optimizer_rows();
    optimizer_desc_rows();
    image_score_rows();
    lpips_rows();
    prior_score_rows();
    prior_flag_rows();
    prior_filter_rows();
    point_rows();
    scene_point_rows();
    prior_rows();
    normals_rows();
    prior_model_rows();
}

void MisuseTable::add(const char* function, const char* parameter, const char* what,
                      splat_result expected, std::function<splat_result()> call) {
    rows_.push_back({function, parameter, what, expected, std::move(call)});
}

void MisuseTable::library_rows() {
    const auto given = [](const char* text) {
        return text != nullptr && *text != '\0' ? SPLAT_OK : SPLAT_ERROR_INTERNAL;
    };
    add("splat_version", "", "as it is", SPLAT_OK,
        [] { return splat_version() != 0 ? SPLAT_OK : SPLAT_ERROR_INTERNAL; });
    add("splat_version_string", "", "as it is", SPLAT_OK,
        [given] { return given(splat_version_string()); });
    add("splat_build_info", "", "as it is", SPLAT_OK,
        [given] { return given(splat_build_info()); });
    for (const splat_result code : {INT32_MIN, -16, 2, INT32_MAX}) {
        add("splat_result_name", "code", "no code", SPLAT_OK,
            [given, code] { return given(splat_result_name(code)); });
        add("splat_result_sentence", "code", "no code", SPLAT_OK,
            [given, code] { return given(splat_result_sentence(code)); });
    }
    add("splat_last_error_message", "", "as it is", SPLAT_OK,
        [] { return splat_last_error_message() != nullptr ? SPLAT_OK : SPLAT_ERROR_INTERNAL; });
    add("splat_last_error_copy", "buffer", "NULL with a capacity", SPLAT_INCOMPLETE,
        [] { return splat_last_error_copy(nullptr, SIZE_MAX, nullptr); });
    add("splat_last_error_copy", "capacity", "0", SPLAT_INCOMPLETE,
        [this] { return splat_last_error_copy(*outputs.text.out(), 0, nullptr); });
    add("splat_last_error_copy", "needed", "NULL", SPLAT_INCOMPLETE,
        [] { return splat_last_error_copy(nullptr, 0, nullptr); });
    const splat_log_callback other = [](void*, splat_log_level, const char*) {};
    for (const splat_log_level level : {INT32_MIN, -1, 5, INT32_MAX})
        for (const char* parameter : {"min_level", "callback", "user"})
            add("splat_log_set_callback", parameter, "with an unknown level", kArgument,
                [level, other] { return splat_log_set_callback(other, nullptr, level); });
    for (int field = 0; field < 4; ++field) {
        auto limits = sized<splat_decode_limits>();
        if (field == 0) limits.struct_size = 8;
        if (field == 1) limits.flags = 1;
        if (field == 2) limits.next = "x";
        if (field == 3) limits.reserved = 1;
        add("splat_decode_set_limits", "limits", "a field that is not known", kArgument,
            [limits] { return splat_decode_set_limits(&limits); });
    }
    add("splat_op_list", "buffer", "NULL with a capacity", SPLAT_INCOMPLETE,
        [] { return splat_op_list(nullptr, SIZE_MAX, nullptr); });
    add("splat_op_list", "capacity", "0", SPLAT_INCOMPLETE,
        [this] { return splat_op_list(*outputs.text.out(), 0, nullptr); });
    add("splat_op_list", "needed", "NULL", SPLAT_INCOMPLETE,
        [] { return splat_op_list(nullptr, 0, nullptr); });
}

void MisuseTable::device_rows() {
    add("splat_device_count", "count", "NULL", kArgument,
        [] { return splat_device_count(nullptr); });
    infos<splat_device_info>("splat_device_describe", "info", [](splat_device_info* info) {
        return splat_device_describe(0, info);
    });
    for (const std::uint32_t index : {1U << 16, UINT32_MAX})
        add("splat_device_describe", "index", "beyond the count", kArgument,
            [this, index] { return splat_device_describe(index, outputs.device_info.out()); });
    handles<splat_device>("splat_device_destroy", "device", splat_device_destroy, SPLAT_OK);
    handles<splat_device>(
        "splat_device_get_info", "device",
        [this](splat_device d) { return splat_device_get_info(d, outputs.device_info.out()); },
        kHandle);
    infos<splat_device_info>("splat_device_get_info", "info", [this](splat_device_info* info) {
        return splat_device_get_info(device_, info);
    });
    handles<splat_device>(
        "splat_device_get_memory", "device",
        [this](splat_device d) { return splat_device_get_memory(d, outputs.memory.out()); },
        kHandle);
    infos<splat_memory_info>("splat_device_get_memory", "info", [this](splat_memory_info* info) {
        return splat_device_get_memory(device_, info);
    });
    handles<splat_device>("splat_device_cancel", "device", splat_device_cancel, kHandle);
    handles<splat_device>("splat_device_profile_reset", "device", splat_device_profile_reset,
                          kHandle);
}

void MisuseTable::device_text_rows() {
    using Text = splat_result (*)(splat_device, char*, std::size_t, std::size_t*);
    for (const auto& [name, text] :
         {std::pair<const char*, Text>{"splat_device_profile_json", splat_device_profile_json},
          std::pair<const char*, Text>{"splat_device_profile_table", splat_device_profile_table}}) {
        const Text function = text;
        handles<splat_device>(
            name, "device",
            [this, function](splat_device d) {
                return function(d, *outputs.text.out(), 16, outputs.size.out());
            },
            kHandle);
        add(name, "buffer", "NULL with a capacity", SPLAT_INCOMPLETE,
            [this, function] { return function(device_, nullptr, SIZE_MAX, nullptr); });
        add(name, "capacity", "0", SPLAT_INCOMPLETE,
            [this, function] { return function(device_, *outputs.text.out(), 0, nullptr); });
        add(name, "needed", "NULL", SPLAT_INCOMPLETE,
            [this, function] { return function(device_, nullptr, 0, nullptr); });
    }
}

void MisuseTable::device_desc_rows() {
    add("splat_device_create", "device", "NULL", kArgument,
        [] { return splat_device_create(nullptr, nullptr); });
    const auto create = [this](const splat_device_desc* desc) {
        return splat_device_create(desc, outputs.device.out());
    };
    descs<splat_device_desc>("splat_device_create", device_desc(), create);
    const auto invalid = [&](const char* what, std::int32_t splat_device_desc::*field) {
        for (const std::int32_t value : {INT32_MIN, -1, 6, INT32_MAX}) {
            splat_device_desc desc = device_desc();
            desc.*field = value;
            add("splat_device_create", "desc", what, kArgument,
                [create, desc] { return create(&desc); });
        }
    };
    invalid("an unknown select", &splat_device_desc::select);
    invalid("an unknown kind", &splat_device_desc::kind);
    invalid("unknown kernels", &splat_device_desc::kernels);
    splat_device_desc desc = device_desc();
    desc.select = SPLAT_SELECT_BY_KIND;
    add("splat_device_create", "desc", "by kind without a kind", kArgument,
        [create, desc] { return create(&desc); });
}

}  // namespace splat::test
