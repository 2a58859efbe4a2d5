// The rows of optimizers.
#include <cmath>

#include "api/misuse/misuse_table.h"

namespace splat::test {

Optimizer MisuseTable::make_optimizer(const splat_optimizer_item& item) const {
    auto desc = sized<splat_optimizer_desc>();
    desc.items = &item;
    desc.item_count = 1;
    Optimizer optimizer;
    EXPECT_DONE(splat_optimizer_create(device_, &desc, optimizer.out()));
    return optimizer;
}

void MisuseTable::optimizer_rows() {
    handles<splat_optimizer>(
        "splat_optimizer_step", "optimizer",
        [this](splat_optimizer o) { return splat_optimizer_step(o, outputs.optimizer_info.out()); },
        kHandle);
    handles<splat_optimizer>("splat_optimizer_zero_gradients", "optimizer",
                             splat_optimizer_zero_gradients, kHandle);
    const auto gather = [](splat_optimizer o, const char* pattern,
                           const std::vector<std::int64_t>& rows) {
        return splat_optimizer_gather_rows(o, pattern, rows.data(), rows.size());
    };
    handles<splat_optimizer>(
        "splat_optimizer_gather_rows", "optimizer",
        [gather](splat_optimizer o) {
            return gather(o, "*", {1, 0});
        },
        kHandle);
    add("splat_optimizer_gather_rows", "pattern", "NULL", kArgument, [this, gather] {
        return gather(optimizer_, nullptr, {1, 0});
    });
    add("splat_optimizer_gather_rows", "pattern", "without a match", kArgument, [this, gather] {
        return gather(optimizer_, "yours", {1, 0});
    });
    add("splat_optimizer_gather_rows", "rows", "NULL", kArgument,
        [this] { return splat_optimizer_gather_rows(optimizer_, "*", nullptr, 2); });
    add("splat_optimizer_gather_rows", "rows", "not in use", kArgument,
        [this, gather] { return gather(optimizer_, "*", {2}); });
    add("splat_optimizer_gather_rows", "rows", "negative", kArgument, [this, gather] {
        return gather(optimizer_, "*", {0, -2});
    });
    add("splat_optimizer_gather_rows", "count", "0", kArgument, [this] {
        const std::int64_t row = 0;
        return splat_optimizer_gather_rows(optimizer_, "*", &row, 0);
    });
    add("splat_optimizer_gather_rows", "count", "more than the tensor holds", kArgument,
        [this, gather] {
            return gather(optimizer_, "*", {0, 1, 0});
        });
    handles<splat_optimizer>(
        "splat_optimizer_set_rate", "optimizer",
        [](splat_optimizer o) { return splat_optimizer_set_rate(o, 1); }, kHandle);
    for (const double rate : {-1.0, static_cast<double>(NAN), static_cast<double>(INFINITY)})
        add("splat_optimizer_set_rate", "rate", "out of range", kArgument,
            [this, rate] { return splat_optimizer_set_rate(optimizer_, rate); });
    handles<splat_optimizer>(
        "splat_optimizer_get_info", "optimizer",
        [this](splat_optimizer o) {
            return splat_optimizer_get_info(o, outputs.optimizer_info.out());
        },
        kHandle);
    infos<splat_optimizer_info>(
        "splat_optimizer_get_info", "info",
        [this](splat_optimizer_info* info) { return splat_optimizer_get_info(optimizer_, info); });
    add("splat_optimizer_step", "info", "a struct_size of no version", kArgument, [this] {
        splat_optimizer_info info{};
        return splat_optimizer_step(optimizer_, &info);
    });
    handles<splat_optimizer>(
        "splat_optimizer_store", "optimizer",
        [this](splat_optimizer o) { return splat_optimizer_store(o, outputs.weights.out()); },
        kHandle);
    add("splat_optimizer_store", "weights", "NULL", kArgument,
        [this] { return splat_optimizer_store(optimizer_, nullptr); });
    handles<splat_optimizer>(
        "splat_optimizer_save", "optimizer",
        [this](splat_optimizer o) { return splat_optimizer_save(o, outputs.weights.out()); },
        kHandle);
    add("splat_optimizer_save", "state", "NULL", kArgument,
        [this] { return splat_optimizer_save(optimizer_, nullptr); });
    handles<splat_optimizer>(
        "splat_optimizer_load", "optimizer",
        [this](splat_optimizer o) { return splat_optimizer_load(o, weights_); }, kHandle);
    handles<splat_weights>(
        "splat_optimizer_load", "state",
        [this](splat_weights w) { return splat_optimizer_load(optimizer_, w); }, kHandle);
    add("splat_optimizer_load", "state", "weights without a state", kArgument,
        [this] { return splat_optimizer_load(optimizer_, weights_); });
    handles<splat_optimizer>("splat_optimizer_destroy", "optimizer", splat_optimizer_destroy,
                             SPLAT_OK);
}

void MisuseTable::optimizer_desc_rows() {
    auto good = sized<splat_optimizer_desc>();
    good.items = &item_;
    good.item_count = 1;
    const auto create = [this](const splat_optimizer_desc* desc) {
        return splat_optimizer_create(device_, desc, outputs.optimizer.out());
    };
    add("splat_optimizer_create", "desc", "NULL", kArgument, [create] { return create(nullptr); });
    descs<splat_optimizer_desc>("splat_optimizer_create", good, create);
    handles<splat_device>(
        "splat_optimizer_create", "device",
        [this, good](splat_device d) {
            return splat_optimizer_create(d, &good, outputs.optimizer.out());
        },
        kHandle);
    add("splat_optimizer_create", "optimizer", "NULL", kArgument,
        [this, good] { return splat_optimizer_create(device_, &good, nullptr); });
    using Desc = splat_optimizer_desc;
    const auto invalid = [&](const char* what, void (*change)(Desc&)) {
        Desc desc = good;
        change(desc);
        add("splat_optimizer_create", "desc", what, kArgument,
            [create, desc] { return create(&desc); });
    };
    invalid("no items", [](Desc& d) { d.item_count = 0; });
    invalid("items NULL", [](Desc& d) { d.items = nullptr; });
    invalid("groups NULL", [](Desc& d) { d.group_count = 1; });
    invalid("a negative rate", [](Desc& d) { d.rate = -1; });
    invalid("a rate that is NaN", [](Desc& d) { d.rate = NAN; });
    invalid("beta1 1", [](Desc& d) { d.beta1 = 1; });
    invalid("a negative beta2", [](Desc& d) { d.beta2 = -0.5; });
    invalid("a negative eps", [](Desc& d) { d.eps = -1; });
    invalid("an unknown schedule", [](Desc& d) { d.schedule = 4; });
    invalid("a negative schedule", [](Desc& d) { d.schedule = -1; });
    invalid("a cosine without an end", [](Desc& d) { d.schedule = SPLAT_SCHEDULE_COSINE; });
    invalid("an end without a cosine", [](Desc& d) { d.total_steps = 9; });
    invalid("a step nowhere", [](Desc& d) { d.schedule = SPLAT_SCHEDULE_STEP; });
    invalid("step_at without a step", [](Desc& d) { d.step_at = 9; });
    invalid("a decay of 1", [](Desc& d) { d.ema_decay = 1; });
    invalid("averages without a decay", [](Desc& d) { d.ema_every = 2; });
    const auto item = [&](const char* what, splat_result expected,
                          const splat_optimizer_item& with) {
        add("splat_optimizer_create", "desc", what, expected, [create, good, with] {
            Desc desc = good;
            desc.items = &with;
            return create(&desc);
        });
    };
    item("an item of nothing", kArgument, {"a", nullptr, nullptr, nullptr, nullptr});
    item("an item of two", kArgument, {"a", model_, nullptr, matrix_, result_});
    item("a tensor without a name", kArgument, {nullptr, nullptr, nullptr, matrix_, result_});
    item("a tensor without a gradient", kArgument, {"a", nullptr, nullptr, matrix_, nullptr});
    item("a gradient that is its parameter", kArgument, {"a", nullptr, nullptr, matrix_, matrix_});
    item("a gradient of another shape", SPLAT_ERROR_SHAPE_MISMATCH,
         {"a", nullptr, nullptr, matrix_, tensor_});
    item("a model without gradients", kState, {nullptr, model_, nullptr, nullptr, nullptr});
    item("a destroyed module", kHandle,
         {nullptr, nullptr, reinterpret_cast<splat_module>(stale_module_), nullptr, nullptr});
}

}  // namespace splat::test
