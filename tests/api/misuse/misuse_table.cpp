#include "api/misuse/misuse_table.h"

namespace splat::test {

MisuseTable::MisuseTable() {
    const splat_camera camera = sample_camera(16, 16);
    EXPECT_DONE(splat_rasterizer_forward_scene(drawn_, nullptr, scene_, &camera, 1, nullptr));
    keep_objects();
    right_descs();
    right_calls();
    generated_rows();
    library_rows();
    device_rows();
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

void MisuseTable::keep_objects() {
    keep(device_, open_device());
    keep(tensor_, make_tensor(device_, {1}));
    keep(op_, make_op(device_, request_));
    keep(scene_, SampleScene(1).create());
    keep(rasterizer_, make_rasterizer(device_, rasterizer_desc(1, 16, 16)));
    keep(state_, make_state(rasterizer_));
    keep(weights_, make_weights());
    keep(model_, make_model(device_));
    keep(module_, make_module(device_));
    keep(predictor_, make_predictor(device_));
    keep(evaluator_, make_evaluator(dataset_));
    keep(comparison_, make_comparison());
    keep(trainer_, make_trainer(device_));
    keep(optimizer_, make_optimizer(item_));
    keep(dataset_, make_dataset());
    keep(batches_, make_batches());
    keep(run_, make_training(device_));
}

void MisuseTable::add(const std::string& function, const std::string& parameter, const char* what,
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
    const splat_log_callback other = [](void*, splat_log_level, const char*) {};
    for (const splat_log_level level : {INT32_MIN, -1, 5, INT32_MAX})
        for (const char* parameter : {"min_level", "callback", "user"})
            add("splat_log_set_callback", parameter, "with an unknown level", kArgument,
                [level, other] { return splat_log_set_callback(other, nullptr, level); });
}

void MisuseTable::device_rows() {
    for (const std::uint32_t index : {1U << 16, UINT32_MAX})
        add("splat_device_describe", "index", "beyond the count", kArgument,
            [this, index] { return splat_device_describe(index, out<splat_device_info>()); });
}

void MisuseTable::device_desc_rows() {
    const auto create = [this](const splat_device_desc* desc) {
        return splat_device_create(desc, out<splat_device>());
    };
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
