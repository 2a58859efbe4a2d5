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
    const auto gather = [](splat_optimizer o, const char* pattern,
                           const std::vector<std::int64_t>& rows) {
        return splat_optimizer_gather_rows(o, pattern, rows.data(), rows.size());
    };
    const auto refused = [this, gather](const char* what, const char* how, const char* pattern,
                                        std::vector<std::int64_t> rows) {
        add("splat_optimizer_gather_rows", what, how, kArgument,
            [this, gather, pattern, rows] { return gather(optimizer_, pattern, rows); });
    };
    refused("pattern", "without a match", "yours", {1, 0});
    refused("rows", "not in use", "*", {2});
    refused("rows", "negative", "*", {0, -2});
    refused("count", "more than the tensor holds", "*", {0, 1, 0});
    add("splat_optimizer_gather_rows", "count", "0", kArgument, [this] {
        const std::int64_t row = 0;
        return splat_optimizer_gather_rows(optimizer_, "*", &row, 0);
    });
    for (const double rate : {-1.0, static_cast<double>(NAN), static_cast<double>(INFINITY)})
        add("splat_optimizer_set_rate", "rate", "out of range", kArgument,
            [this, rate] { return splat_optimizer_set_rate(optimizer_, rate); });
    add("splat_optimizer_load", "state", "weights without a state", kArgument,
        [this] { return splat_optimizer_load(optimizer_, weights_); });
}

void MisuseTable::optimizer_desc_rows() {
    auto good = sized<splat_optimizer_desc>();
    good.items = &item_;
    good.item_count = 1;
    const auto create = [this](const splat_optimizer_desc* desc) {
        return splat_optimizer_create(device_, desc, out<splat_optimizer>());
    };
    using Desc = splat_optimizer_desc;
    const auto invalid = wrong_descs<Desc>("splat_optimizer_create");
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
         {nullptr, nullptr, stale<splat_module>(), nullptr, nullptr});
}

}  // namespace splat::test
