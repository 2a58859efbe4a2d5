#include "run/leader.h"

namespace splat::run {

Leader::~Leader() {
    // A forked child has no part in the group.
    if (forks_ == fork_generation())
        fail(error(Code::kCancelled, "the run was closed before its end"));
}

Status Leader::greet(const std::string& library) {
    if (alone()) return {};
    failed_ = compare_versions(*group_, library);
    over_ = !failed_.ok();
    return failed_;
}

Status Leader::together(Order order, const std::function<Status()>& mine) {
    if (alone()) return mine();
    SPLAT_TRY(failed_);
    Status done = broadcast(*group_, order);
    bool any = false;
    if (done.ok()) done = group_->agree(told(mine), &any);
    interrupted_ = interrupted_ || any;
    if (done.ok()) return {};
    agreed_ = done.message();
    if (order.what == Order::What::kLoad && group_->failed().ok()) return done;
    failed_ = done;
    over_ = true;
    return done;
}

Status Leader::compare(Task& task, Messages& messages) {
    if (alone()) return {};
    const auto facts = task.facts();
    Order order{.what = Order::What::kCompare};
    if (facts.ok())
        for (const auto& [name, value] : facts.value().equal) {
            order.texts.push_back(name);
            order.texts.push_back(value);
        }
    SPLAT_TRY(together(std::move(order), [&] { return facts.status(); }));
    SPLAT_ASSIGN(const std::string warning, compare_devices(*group_, facts.value().device));
    if (!warning.empty()) messages.push_back({warning, true});
    return {};
}

Status Leader::load(const io::WeightsFile& state, Task& task) {
    return together({.what = Order::What::kLoad}, [&] {
        if (!alone()) SPLAT_TRY(broadcast(*group_, &state).status());
        return task.load(state);
    });
}

Status Leader::end(std::int32_t kind, const std::string& text) {
    if (alone()) return {};
    over_ = true;
    Order order{.what = Order::What::kEnd, .code = kind, .texts = {text}};
    return broadcast(*group_, order);
}

void Leader::fail(const Status& status) {
    if (alone() || over_) return;
    over_ = true;
    failed_ = status;
    const bool known = status.message() == agreed_;
    Order order{.what = Order::What::kFail,
                .code = static_cast<std::int32_t>(status.code()),
                .texts = {known ? agreed_ : "rank 0: " + status.message()}};
    (void)broadcast(*group_, order);  // whom it does not reach has an error of its own
}

}  // namespace splat::run
