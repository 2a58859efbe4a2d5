// The rows of training: configurations, trainers, sessions, optimizers and LPIPS.
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {

void MisuseTable::config_rows() {
    static const char* const kNone[] = {nullptr};
    static const char* const kOdd[] = {"opt.base_lr"};
    static const char* const kWrong[] = {"opt.base_lr=fast"};
    SPLAT_WRONG(splat_config_preset).each("name", "an unknown one", kArgument, "car");
    const auto both = [](const auto& rows) {
        rows.each("text", "an invalid configuration", kArgument, "]")
            .given("count", 1)
            .each("values", "NULL", kArgument, nullptr);
        rows.given("values", kNone).each("count", "beyond the array", kArgument, 1);
    };
    const auto merge = SPLAT_WRONG(splat_config_merge);
    both(merge);
    both(SPLAT_WRONG(splat_config_check));
    merge.each("text", "an unknown key", kArgument, "opt: {base_rate: 1}")
        .given("count", 1)
        .each("values", "NULL, no value, one of another kind", kArgument, kNone, kOdd, kWrong);
    SPLAT_WRONG(splat_config_check)
        .each("text", "another training", kArgument, "opt: {pretrained_hf: true}");
}

void MisuseTable::training_rows() {
    wrong_structs<splat_trainer_desc>("splat_trainer_create")(
        "an unknown key", kArgument, [](auto& d) { d.config = "opt: {batchsize: 1}"; });
    const auto paths = [](const auto& rows, const char* what) {
        rows.each("path", what, kArgument, nullptr)
            .each("path", what, kNotFound, "/nowhere/state.safetensors");
    };
    paths(SPLAT_WRONG(splat_trainer_save), "NULL, in no folder");
    paths(SPLAT_WRONG(splat_trainer_resume), "NULL, no file");
    SPLAT_WRONG(splat_trainer_save).each("path", "of another format", kUnsupported, "state.pth");
    const auto batch = wrong_structs<splat_trainer_batch>("splat_trainer_step", "batch");
    batch("no images", kArgument, [](auto&) {});
    batch("struct_size cut", kArgument, [](auto& b) { b.struct_size -= 1; });  // below the first
    const auto none = SPLAT_WRONG(splat_trainer_read).given("infos", nullptr);
    none.given("capacity", 1U).as_is("capacity", "of no array", kArgument);
    none.given("capacity", 0U).each("count", "NULL: not wanted", SPLAT_OK, nullptr);
    const auto batches = SPLAT_WRONG(splat_batches_create);
    batches.each("config", "an unknown key", kArgument, "opt: {batchsize: 1}")
        .given("config", trainer_desc().config)
        .as_is("dataset", "of another resolution", kArgument)
        .given("config", nullptr)
        .each("seed", "any number, with a wrong data set", kArgument, 7);
    SPLAT_WRONG(splat_batches_next)
        .given("batch", sized<splat_trainer_batch>())
        .each("step", "the greatest number", SPLAT_OK, UINT64_MAX / 4);
    SPLAT_WRONG(splat_fit_score).each("border", "out of range", kArgument, -1.0, 0.5, NAN);
    using Desc = splat_training_desc;
    const auto session = wrong_structs<Desc>("splat_training_open");
    session("no folder", kArgument, [](auto& d) { d.folder = nullptr; });
    session("an unknown key", kArgument, [](auto& d) { d.config = "opt: {x: 1}"; });
    session("no values", kArgument, [](auto& d) { d.values = nullptr; });
    session("resume and overwrite", kArgument,
            [](auto& d) { d.flags = SPLAT_TRAINING_RESUME | SPLAT_TRAINING_OVERWRITE; });
    session("nothing to resume", kState, [](auto& d) { d.flags = SPLAT_TRAINING_RESUME; });
    session("unknown init_flags", kArgument, [](auto& d) { d.init_flags = 1U << 31; });
    session("init_flags without init", kArgument, [](auto& d) { d.init_flags = SPLAT_LOAD_GRAFT; });
    for (void (*set)(splat_group&) :
         {+[](splat_group& g) { g.rank = 2; }, +[](splat_group& g) { g.count = 3; },
          +[](splat_group& g) { g.barrier = nullptr; }, +[](splat_group& g) { g.reserved = 1; },
          +[](splat_group& g) { g.struct_size -= 1; }})
        session("a wrong group", kArgument, [set](auto& d) {
            static splat_group group;
            group = sized<splat_group>();
            group.count = 2;
            group.send_receive = [](void*, std::uint32_t, const void*, void*, std::uint64_t) {
                return 1;
            };
            group.broadcast = [](void*, std::uint32_t, void*, std::uint64_t) { return 1; };
            group.barrier = [](void*) { return 1; };
            set(group);
            d.group = &group;
        });
    session("a data set of another resolution", kArgument, [](auto&) {});
    session("no data", kArgument, [](auto& d) { d.dataset = nullptr; });
    for (auto Desc::*field : {&Desc::dataset, &Desc::validation})
        session("not a data set", kHandle, [field](auto& d) {
            d.*field = reinterpret_cast<splat_dataset>(std::uintptr_t{1});
        });
    static const splat_weights kNone = nullptr;
    const auto lpips = wrong_structs<splat_lpips_desc>("splat_lpips_create");
    lpips("weights of another network", kArgument, [](auto&) {});
    lpips("no weights", kArgument, [](auto& d) { d.weights = nullptr; });
    lpips("a count of 0", kArgument, [](auto& d) { d.weight_count = 0; });
    lpips("a side of 15", kArgument, [](auto& d) { d.side = 15; });
    lpips("a handle that is NULL", kHandle, [](auto& d) { d.weights = &kNone; });
    splat_image unknown = good<splat_image>();
    unknown.type = 0;
    for (const char* parameter : {"a", "b"})
        SPLAT_WRONG(splat_lpips_compare)
            .each(parameter, "NULL, a type", kArgument, nullptr, unknown);
}

void MisuseTable::optimizer_rows() {
    static constexpr std::int64_t kRows[] = {0, 1, 0}, kUnused[] = {2}, kNegative[] = {0, -2};
    const auto gather =
        SPLAT_WRONG(splat_optimizer_gather_rows).given("pattern", "*").given("rows", kRows);
    gather.given("pattern", "yours")
        .given("count", 2)
        .as_is("pattern", "without a match", kArgument);
    gather.given("count", 1).each("rows", "not in use", kArgument, kUnused);
    gather.given("count", 2).each("rows", "negative", kArgument, kNegative);
    gather.each("count", "more than the tensor holds", kArgument, 3)
        .each("count", "0", kArgument, 0);
    SPLAT_WRONG(splat_optimizer_set_rate)
        .each("rate", "out of range", kArgument, -1.0, NAN, INFINITY);
    SPLAT_WRONG(splat_optimizer_load).each("state", "weights without a state", kArgument, weights_);
    const auto invalid = wrong_structs<splat_optimizer_desc>("splat_optimizer_create");
    invalid("no items", kArgument, [](auto& d) { d.item_count = 0; });
    invalid("items NULL", kArgument, [](auto& d) { d.items = nullptr; });
    invalid("groups NULL", kArgument, [](auto& d) { d.group_count = 1; });
    invalid("a negative rate", kArgument, [](auto& d) { d.rate = -1; });
    invalid("a rate that is NaN", kArgument, [](auto& d) { d.rate = NAN; });
    invalid("beta1 1", kArgument, [](auto& d) { d.beta1 = 1; });
    invalid("a negative beta2", kArgument, [](auto& d) { d.beta2 = -0.5; });
    invalid("a negative eps", kArgument, [](auto& d) { d.eps = -1; });
    invalid("an unknown schedule", kArgument, [](auto& d) { d.schedule = 4; });
    invalid("a negative schedule", kArgument, [](auto& d) { d.schedule = -1; });
    invalid("a cosine without an end", kArgument,
            [](auto& d) { d.schedule = SPLAT_SCHEDULE_COSINE; });
    invalid("an end without a cosine", kArgument, [](auto& d) { d.total_steps = 9; });
    invalid("a step nowhere", kArgument, [](auto& d) { d.schedule = SPLAT_SCHEDULE_STEP; });
    invalid("step_at without a step", kArgument, [](auto& d) { d.step_at = 9; });
    invalid("a decay of 1", kArgument, [](auto& d) { d.ema_decay = 1; });
    invalid("averages without a decay", kArgument, [](auto& d) { d.ema_every = 2; });
    const auto item = [&](const char* what, splat_result expected,
                          const splat_optimizer_item& with) {
        items_.push_back(with);
        invalid(what, expected, [&kept = items_.back()](auto& d) { d.items = &kept; });
    };
    item("an item of nothing", kArgument, {"a", nullptr, nullptr, nullptr, nullptr});
    item("an item of two", kArgument, {"a", model_, nullptr, matrix_, result_});
    item("a tensor without a name", kArgument, {nullptr, nullptr, nullptr, matrix_, result_});
    item("a tensor without a gradient", kArgument, {"a", nullptr, nullptr, matrix_, nullptr});
    item("a gradient that is its parameter", kArgument, {"a", nullptr, nullptr, matrix_, matrix_});
    item("a gradient of another shape", kShape, {"a", nullptr, nullptr, matrix_, tensor_});
    item("a model without gradients", kState, {nullptr, model_, nullptr, nullptr, nullptr});
    item("a destroyed module", kHandle,
         {nullptr, nullptr, stale<splat_module>(), nullptr, nullptr});
}

}  // namespace splat::test
