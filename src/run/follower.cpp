#include "run/follower.h"

#include <algorithm>
#include <utility>

namespace splat::run {

using What = Order::What;

Result<std::unique_ptr<Follower>> Follower::open(Group& group, const std::string& library,
                                                 std::unique_ptr<Task> task,
                                                 const Interrupt& interrupt) {
    std::unique_ptr<Follower> self(new Follower(group, std::move(task), interrupt));
    SPLAT_TRY(compare_versions(group, library));
    while (!self->opened_) SPLAT_TRY(self->obey());
    return self;
}

Status Follower::obey() {
    Order order;
    SPLAT_TRY(broadcast(group_, order));
    if (order.what == What::kFail) return {static_cast<Code>(order.code), order.texts.at(0)};
    if (order.what == What::kEnd) {
        ended_ = static_cast<EventKind>(order.code);
        ended_text_ = order.texts.at(0);
        return {};
    }
    const Status mine = told([&] { return carry_out(order); });
    bool interrupted = interrupt_.count() != raised_before_;
    const Status all = group_.agree(mine, &interrupted);
    if (order.what == What::kLoad) return {};  // rank 0 tries another state, or gives up
    SPLAT_TRY(all);
    if (order.what == What::kCompare) SPLAT_TRY(compare_devices(group_, facts_.device).status());
    opened_ = opened_ || order.what == What::kOpen;
    return {};
}

Status Follower::carry_out(const Order& order) {
    const auto read = [&] { return ReadText{order.texts.at(0), order.texts.at(1)}; };
    switch (order.what) {
        case What::kPrepare: {
            const ReadText config = order.texts.empty() ? ReadText() : read();
            SPLAT_SET(plan_, task_->prepare(order.texts.empty() ? nullptr : &config, ignored_));
            return {};
        }
        case What::kCompare:
            SPLAT_SET(facts_, task_->facts());
            return compare_facts(facts_, order.texts);
        case What::kStart:
            if (!order.texts.empty()) {
                const auto json = parse_json_tree(order.texts.at(1), "run.json");
                SPLAT_TRY(task_->recall(json.ok() ? json.value() : JsonTree(), order.texts.at(0)));
            }
            return task_->start(ignored_);
        case What::kLoad: {
            SPLAT_ASSIGN(const io::WeightsFile state, broadcast(group_, nullptr));
            return task_->load(state);
        }
        case What::kBegin:
            return begin(order);
        case What::kStep:
            if (!begun_) begun_.emplace();
            return task_->step(order.number, done_);
        default:
            return {};
    }
}

Status Follower::begin(const Order& order) {
    if (!order.texts.empty()) {
        SPLAT_ASSIGN(const std::string sum, checksum_of(*task_));
        if (sum != order.texts.at(0))
            return invalid(
                "the weights to start from are not those of rank 0 (checksum %s, but %s there): "
                "give all ranks the same",
                sum.c_str(), order.texts.at(0).c_str());
    }
    SPLAT_TRY(task_->begin());
    const Progress progress = task_->progress();
    step_ = begun_at_ = progress.steps;
    attempts_ = progress.attempts;
    skipped_ = progress.attempts - progress.steps;
    return {};
}

Status Follower::next(Event& event) {
    while (done_.empty() && !ended_) {
        SPLAT_TRY(failed_);
        failed_ = obey();
    }
    event = {};
    event.iterations = plan_.iterations;
    if (!done_.empty()) {
        after_step(done_.front(), event);
        done_.pop_front();
        return {};
    }
    event.kind = *ended_;
    event.text = std::exchange(ended_text_, {});
    event.step = step_;
    event.attempts = attempts_;
    event.skipped = skipped_;
    event.peak_bytes = task_->peak_bytes();
    event.seconds = seconds();
    return {};
}

void Follower::after_step(const Step& done, Event& event) {
    event.kind = EventKind::kStep;
    event.updated = done.outcome != Outcome::kSkipped;
    event.step = step_ = done.progress.steps;
    event.attempts = attempts_ = done.progress.attempts;
    event.skipped = skipped_ = attempts_ - step_;
    event.peak_bytes = done.peak_bytes;
    event.seconds = seconds();
    event.steps_per_second = static_cast<double>(step_ - begun_at_) / std::max(event.seconds, 1e-9);
    if (event.updated) loss_ = done.loss;
    ledger_ = done.ledger;
    event.numbers = {{"loss", done.loss}};
    for (const Numbers* more : {&done.numbers, &done.terms, &done.ledger})
        event.numbers.insert(event.numbers.end(), more->begin(), more->end());
}

Figures Follower::figures() const {
    return {.folder = {},
            .step = step_,
            .iterations = plan_.iterations,
            .skipped = skipped_,
            .loss = loss_,
            .peak_bytes = task_->peak_bytes(),
            .ledger = ledger_};
}

}  // namespace splat::run
