// The rows of training and of image scores.
#include "api/misuse/misuse_table.h"

namespace splat::test {

void MisuseTable::config_rows() {
    const auto merge = [this](const char* text, const char* const* values, std::size_t count) {
        return splat_config_merge(text, values, count, text_out(), 16, out<std::size_t>());
    };
    const auto preset = [this](const char* name) {
        return splat_config_preset(name, text_out(), 16, out<std::size_t>());
    };
    add("splat_config_preset", "name", "an unknown one", kArgument,
        [preset] { return preset("car"); });
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
    const auto check = [this](const char* text, const char* const* values, std::size_t count) {
        return splat_config_check(text, values, count, text_out(), 16, out<std::size_t>());
    };
    add("splat_config_check", "text", "an invalid configuration", kArgument,
        [check] { return check("]", nullptr, 0); });
    add("splat_config_check", "text", "another training", kArgument,
        [check] { return check("opt: {pretrained_hf: true}", nullptr, 0); });
    add("splat_config_check", "values", "NULL", kArgument,
        [check] { return check(nullptr, nullptr, 1); });
    add("splat_config_check", "count", "beyond the array", kArgument,
        [check] { return check(nullptr, kNone, 1); });
}

void MisuseTable::trainer_rows() {
    const splat_trainer_desc good = trainer_desc();
    add("splat_trainer_create", "desc", "an unknown key", kArgument, [this, good] {
        splat_trainer_desc desc = good;
        desc.config = "opt: {batchsize: 1}";
        return splat_trainer_create(device_, &desc, out<splat_trainer>());
    });
    for (const char* path : {static_cast<const char*>(nullptr), "/nowhere/state.safetensors"}) {
        const splat_result expected = path == nullptr ? kArgument : kNotFound;
        add("splat_trainer_save", "path", "NULL, in no folder", expected,
            [this, path] { return splat_trainer_save(trainer_, path); });
        add("splat_trainer_resume", "path", "NULL, no file", expected,
            [this, path] { return splat_trainer_resume(trainer_, path); });
    }
    add("splat_trainer_save", "path", "of another format", SPLAT_ERROR_UNSUPPORTED,
        [this] { return splat_trainer_save(trainer_, "state.pth"); });
    trainer_step_rows();
}

void MisuseTable::trainer_step_rows() {
    const auto batch = sized<splat_trainer_batch>();
    add("splat_trainer_step", "batch", "no images", kArgument,
        [this, batch] { return splat_trainer_step(trainer_, &batch, out<splat_trainer_info>()); });
    add("splat_trainer_step", "batch", "struct_size cut", kArgument, [this, batch] {
        splat_trainer_batch cut = batch;
        cut.struct_size -= 1;  // less than the first version
        return splat_trainer_step(trainer_, &cut, out<splat_trainer_info>());
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
        return splat_lpips_create(device_, desc, out<splat_lpips>());
    };
    const auto invalid = [&](const char* what, splat_result expected, splat_lpips_desc desc) {
        add("splat_lpips_create", "desc", what, expected, [create, desc] { return create(&desc); });
    };
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
    for (const splat_image* wrong : {static_cast<const splat_image*>(nullptr), &kUnknown}) {
        add("splat_lpips_compare", "a", "NULL, a type", kArgument,
            [this, wrong] { return splat_lpips_compare(nullptr, wrong, &kImage, out<double>()); });
        add("splat_lpips_compare", "b", "NULL, a type", kArgument,
            [this, wrong] { return splat_lpips_compare(nullptr, &kImage, wrong, out<double>()); });
    }
}

}  // namespace splat::test
