// The rows of training and of image scores.
#include "api/misuse/misuse_table.h"

namespace splat::test {

void MisuseTable::config_rows() {
    const auto merge = [this](const char* text, const char* const* values, std::size_t count) {
        return splat_config_merge(text, values, count, *outputs.text.out(), 16, outputs.size.out());
    };
    add("splat_config_keys", "buffer", "NULL with a capacity", SPLAT_INCOMPLETE,
        [] { return splat_config_keys(nullptr, SIZE_MAX, nullptr); });
    add("splat_config_keys", "capacity", "0", SPLAT_INCOMPLETE,
        [this] { return splat_config_keys(*outputs.text.out(), 0, nullptr); });
    add("splat_config_keys", "needed", "NULL", SPLAT_INCOMPLETE,
        [] { return splat_config_keys(nullptr, 0, nullptr); });
    add("splat_config_presets", "buffer", "NULL with a capacity", SPLAT_INCOMPLETE,
        [] { return splat_config_presets(nullptr, SIZE_MAX, nullptr); });
    add("splat_config_presets", "capacity", "0", SPLAT_INCOMPLETE,
        [this] { return splat_config_presets(*outputs.text.out(), 0, nullptr); });
    add("splat_config_presets", "needed", "NULL", SPLAT_INCOMPLETE,
        [] { return splat_config_presets(nullptr, 0, nullptr); });
    const auto preset = [this](const char* name) {
        return splat_config_preset(name, *outputs.text.out(), 16, outputs.size.out());
    };
    add("splat_config_preset", "name", "NULL", kArgument, [preset] { return preset(nullptr); });
    add("splat_config_preset", "name", "an unknown one", kArgument,
        [preset] { return preset("car"); });
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_config_preset", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [] { return splat_config_preset("cars", nullptr, 0, nullptr); });
    add("splat_config_merge", "text", "an invalid configuration", kArgument,
        [merge] { return merge("]", nullptr, 0); });
    add("splat_config_merge", "text", "an unknown key", kArgument,
        [merge] { return merge("opt: {base_rate: 1}", nullptr, 0); });
    add("splat_config_merge", "values", "NULL", kArgument,
        [merge] { return merge(nullptr, nullptr, 1); });
    static const char* const kNone[] = {nullptr};
    static const char* const kOdd[] = {"opt.base_lr"};
    static const char* const kWrong[] = {"opt.base_lr=fast"};
    for (const auto* values : {kNone, kOdd, kWrong})
        add("splat_config_merge", "values", "NULL, no value, one of another kind", kArgument,
            [merge, values] { return merge(nullptr, values, 1); });
    add("splat_config_merge", "count", "beyond the array", kArgument,
        [merge] { return merge(nullptr, kNone, 1); });
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_config_merge", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [] { return splat_config_merge(nullptr, nullptr, 0, nullptr, 0, nullptr); });
    const auto check = [this](const char* text, const char* const* values, std::size_t count) {
        return splat_config_check(text, values, count, *outputs.text.out(), 16, outputs.size.out());
    };
    add("splat_config_check", "text", "an invalid configuration", kArgument,
        [check] { return check("]", nullptr, 0); });
    add("splat_config_check", "text", "another training", kArgument,
        [check] { return check("opt: {pretrained_hf: true}", nullptr, 0); });
    add("splat_config_check", "values", "NULL", kArgument,
        [check] { return check(nullptr, nullptr, 1); });
    add("splat_config_check", "count", "beyond the array", kArgument,
        [check] { return check(nullptr, kNone, 1); });
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_config_check", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [] { return splat_config_check(nullptr, nullptr, 0, nullptr, 0, nullptr); });
}

void MisuseTable::trainer_rows() {
    const splat_trainer_desc good = trainer_desc();
    handles<splat_device>(
        "splat_trainer_create", "device",
        [this, good](splat_device d) {
            return splat_trainer_create(d, &good, outputs.trainer.out());
        },
        kHandle);
    descs<splat_trainer_desc>("splat_trainer_create", good, [this](const splat_trainer_desc* desc) {
        return splat_trainer_create(device_, desc, outputs.trainer.out());
    });
    add("splat_trainer_create", "desc", "NULL", kArgument,
        [this] { return splat_trainer_create(device_, nullptr, outputs.trainer.out()); });
    add("splat_trainer_create", "trainer", "NULL", kArgument,
        [this, good] { return splat_trainer_create(device_, &good, nullptr); });
    add("splat_trainer_create", "desc", "an unknown key", kArgument, [this, good] {
        splat_trainer_desc desc = good;
        desc.config = "opt: {batchsize: 1}";
        return splat_trainer_create(device_, &desc, outputs.trainer.out());
    });
    const auto on_trainer = [this](const char* name,
                                   std::function<splat_result(splat_trainer)> call) {
        handles<splat_trainer>(name, "trainer", std::move(call), kHandle);
    };
    on_trainer("splat_trainer_model",
               [this](splat_trainer t) { return splat_trainer_model(t, outputs.model.out()); });
    add("splat_trainer_model", "model", "NULL", kArgument,
        [this] { return splat_trainer_model(trainer_, nullptr); });
    on_trainer("splat_trainer_store",
               [this](splat_trainer t) { return splat_trainer_store(t, outputs.weights.out()); });
    add("splat_trainer_store", "weights", "NULL", kArgument,
        [this] { return splat_trainer_store(trainer_, nullptr); });
    on_trainer("splat_trainer_report", [this](splat_trainer t) {
        return splat_trainer_report(t, *outputs.text.out(), 16, outputs.size.out());
    });
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_trainer_report", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [this] { return splat_trainer_report(trainer_, nullptr, 0, nullptr); });
    on_trainer("splat_trainer_save",
               [](splat_trainer t) { return splat_trainer_save(t, "state.safetensors"); });
    on_trainer("splat_trainer_resume",
               [](splat_trainer t) { return splat_trainer_resume(t, "state.safetensors"); });
    for (const char* path : {static_cast<const char*>(nullptr), "/nowhere/state.safetensors"}) {
        const splat_result expected = path == nullptr ? kArgument : kNotFound;
        add("splat_trainer_save", "path", "NULL, in no folder", expected,
            [this, path] { return splat_trainer_save(trainer_, path); });
        add("splat_trainer_resume", "path", "NULL, no file", expected,
            [this, path] { return splat_trainer_resume(trainer_, path); });
    }
    add("splat_trainer_save", "path", "of another format", SPLAT_ERROR_UNSUPPORTED,
        [this] { return splat_trainer_save(trainer_, "state.pth"); });
    handles<splat_trainer>("splat_trainer_destroy", "trainer", splat_trainer_destroy, SPLAT_OK);
    trainer_step_rows();
}

void MisuseTable::trainer_step_rows() {
    const auto batch = sized<splat_trainer_batch>();
    handles<splat_trainer>(
        "splat_trainer_step", "trainer",
        [this, batch](splat_trainer t) {
            return splat_trainer_step(t, &batch, outputs.trainer_info.out());
        },
        kHandle);
    add("splat_trainer_step", "batch", "NULL", kArgument,
        [this] { return splat_trainer_step(trainer_, nullptr, outputs.trainer_info.out()); });
    add("splat_trainer_step", "batch", "no images", kArgument,
        [this, batch] { return splat_trainer_step(trainer_, &batch, outputs.trainer_info.out()); });
    add("splat_trainer_step", "batch", "struct_size cut", kArgument, [this, batch] {
        splat_trainer_batch cut = batch;
        cut.struct_size -= 1;  // less than the first version
        return splat_trainer_step(trainer_, &cut, outputs.trainer_info.out());
    });
    infos<splat_trainer_info>("splat_trainer_step", "info",
                              [this, batch](splat_trainer_info* info) {
                                  return splat_trainer_step(trainer_, &batch, info);
                              });
}

void MisuseTable::lpips_rows() {
    static float kBlack[3 * 16 * 16] = {};
    static const splat_image kImage = {kBlack, sizeof kBlack, SPLAT_PIXEL_F32, 16, 16, 3, 0, 0, 0};
    static const splat_image kUnknown = {kBlack, 0, 0, 16, 16, 3, 0, 0, 0};
    static const splat_weights kNone = nullptr;
    auto good = sized<splat_lpips_desc>();
    good.weights = &weights_handle_;
    good.weight_count = 1;
    good.side = 16;
    const auto create = [this](const splat_lpips_desc* desc) {
        return splat_lpips_create(device_, desc, outputs.lpips.out());
    };
    handles<splat_device>(
        "splat_lpips_create", "device",
        [this, good](splat_device device) {
            return splat_lpips_create(device, &good, outputs.lpips.out());
        },
        kHandle);
    descs<splat_lpips_desc>("splat_lpips_create", good, create);
    const auto invalid = [&](const char* what, splat_result expected, splat_lpips_desc desc) {
        add("splat_lpips_create", "desc", what, expected, [create, desc] { return create(&desc); });
    };
    add("splat_lpips_create", "desc", "NULL", kArgument, [create] { return create(nullptr); });
    add("splat_lpips_create", "lpips", "NULL", kArgument,
        [this, good] { return splat_lpips_create(device_, &good, nullptr); });
    invalid("weights of another network", kArgument, good);
    auto desc = good;
    desc.weights = nullptr;
    invalid("no weights", kArgument, desc);
    desc = good;
    desc.weight_count = 0;
    invalid("a count of 0", kArgument, desc);
    desc = good;
    desc.side = 15;
    invalid("a side of 15", kArgument, desc);
    desc = good;
    desc.weights = &kNone;
    invalid("a handle that is NULL", kHandle, desc);
    handles<splat_lpips>(
        "splat_lpips_compare", "lpips",
        [this](splat_lpips lpips) {
            return splat_lpips_compare(lpips, &kImage, &kImage, outputs.distance.out());
        },
        kHandle);
    for (const splat_image* wrong : {static_cast<const splat_image*>(nullptr), &kUnknown}) {
        add("splat_lpips_compare", "a", "NULL, a type", kArgument, [this, wrong] {
            return splat_lpips_compare(nullptr, wrong, &kImage, outputs.distance.out());
        });
        add("splat_lpips_compare", "b", "NULL, a type", kArgument, [this, wrong] {
            return splat_lpips_compare(nullptr, &kImage, wrong, outputs.distance.out());
        });
    }
    add("splat_lpips_compare", "value", "NULL", kArgument,
        [] { return splat_lpips_compare(nullptr, &kImage, &kImage, nullptr); });
    handles<splat_lpips>("splat_lpips_destroy", "lpips", splat_lpips_destroy, SPLAT_OK);
}

}  // namespace splat::test
