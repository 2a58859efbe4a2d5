#include "api/misuse/misuse_table.h"

namespace splat::test {

MisuseTable::MisuseTable() {
    const splat_camera camera = sample_camera(16, 16);
    EXPECT_DONE(splat_rasterizer_forward_scene(drawn_, nullptr, scene_, &camera, 1, nullptr));
    keep_objects();
    right_descs();
    right_calls();
    generated_rows();
    device_rows();
    tensor_rows();
    scene_rows();
    scene_file_rows();
    camera_rows();
    camera_file_rows();
    rasterizer_rows();
    forward_rows();
    raster_output_rows();
    scene_render_rows();
    mesh_rows();
    image_rows();
    image_memory_rows();
    weights_rows();
    memory_rows();
    dataset_rows();
    table_rows();
    model_rows();
    model_pass_rows();
    module_rows();
    config_rows();
    training_rows();
    picture_rows();
    predictor_rows();
    evaluator_rows();
    comparison_rows();
    optimizer_rows();
    prior_score_rows();
    point_rows();
    prior_model_rows();
}

void MisuseTable::keep_objects() {
    keep(device_, open_device());
    keep(tensor_, make_tensor(device_, {1}));
    keep(op_, make_op(device_, request_));
    keep(scene_, SampleScene(1).create());
    keep(mesh_, make_mesh());
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

Optimizer MisuseTable::make_optimizer(const splat_optimizer_item& item) const {
    auto desc = sized<splat_optimizer_desc>();
    desc.items = &item;
    desc.item_count = 1;
    return got(splat_optimizer_create, device_, desc);
}

void MisuseTable::device_rows() {
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
            SPLAT_WRONG(splat_log_set_callback)
                .given("callback", other)
                .given("min_level", level)
                .as_is(parameter, "with an unknown level", kArgument);
    SPLAT_WRONG(splat_device_describe)
        .each("index", "beyond the count", kArgument, 1U << 16, UINT32_MAX);
    const auto invalid = wrong_structs<splat_device_desc>("splat_device_create");
    for (const std::int32_t value : {INT32_MIN, -1, 6, INT32_MAX}) {
        invalid("an unknown select", kArgument, [value](auto& d) { d.select = value; });
        invalid("an unknown kind", kArgument, [value](auto& d) { d.kind = value; });
        invalid("unknown kernels", kArgument, [value](auto& d) { d.kernels = value; });
    }
    invalid("by kind without a kind", kArgument, [](auto& d) { d.select = SPLAT_SELECT_BY_KIND; });
    // tests/api/engine has a device of an application.
    wrong_structs<splat_vulkan_desc>("splat_device_from_vulkan", "vulkan")("without handles",
                                                                           kArgument, [](auto&) {});
    wrong_structs<splat_device_desc>("splat_device_from_vulkan")(
        "chosen by index", kArgument, [](auto& d) { d.select = SPLAT_SELECT_BY_INDEX; });
}

void MisuseTable::tensor_rows() {
    const auto both = [this](const auto& rows) {
        rows.each("desc", "NULL", kArgument, nullptr);
        const auto invalid = wrong_structs<splat_tensor_desc>(rows.function());
        invalid("a rank too high", kArgument, [](auto& d) { d.rank = SPLAT_MAX_RANK + 1; });
        invalid("the highest rank", kArgument, [](auto& d) { d.rank = UINT32_MAX; });
        invalid("an unknown dtype", kArgument, [](auto& d) { d.dtype = 4; });
        invalid("a negative dtype", kArgument, [](auto& d) { d.dtype = -1; });
        invalid("no elements", kArgument, [](auto& d) { d.dims[0] = 0; });
        invalid("too many elements", kArgument, [](auto& d) { d.dims[0] = INT64_MAX; });
    };
    both(SPLAT_WRONG(splat_tensor_create));
    both(SPLAT_WRONG(splat_tensor_from_host));
    both(SPLAT_WRONG(splat_tensor_import));
    SPLAT_WRONG(splat_tensor_export).as_is("tensor", "not exportable", kState);
    const auto copies = [](const auto& rows) {
        rows.each("data", "NULL", kArgument, nullptr)
            .each("bytes", "too few", kArgument, 0, 15)
            .each("strides", "outside the memory given", kArgument, std::int64_t{-1}, INT64_MIN,
                  INT64_MAX, std::int64_t{2});
    };
    copies(SPLAT_WRONG(splat_tensor_write));
    copies(SPLAT_WRONG(splat_tensor_read));
    copies(SPLAT_WRONG(splat_tensor_from_host));
    for (const splat_access access : {INT32_MIN, -1, 0, 4, INT32_MAX})
        for (const char* parameter : {"access", "bytes"})
            SPLAT_WRONG(splat_tensor_map)
                .given("access", access)
                .as_is(parameter, "with an unknown access", kArgument);
    SPLAT_WRONG(splat_tensor_unmap).as_is("tensor", "not mapped", kState);
    SPLAT_WRONG(splat_tensor_host_pointer)
        .given("pointer", nullptr)
        .as_is("bytes", "with a NULL pointer", kArgument);
    SPLAT_WRONG(splat_op_backward).as_is("op", "before the first forward", kState);
    handles<splat_tensor>(
        "splat_op_create", "desc",
        [this](splat_tensor t) {
            OpRequest request = request_;
            request.inputs[0] = t;
            const splat_op_desc desc = request.desc();
            return splat_op_create(device_, &desc, out<splat_op>());
        },
        kHandle);
}

}  // namespace splat::test
