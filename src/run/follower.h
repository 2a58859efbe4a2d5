#pragma once

#include "run/order.h"
#include "run/run.h"

namespace splat::run {

/// A rank other than 0: its task does what rank 0's run orders. It has no folder, saves nothing and validates nothing.
/// Its events are those of steps, without an averaged loss, and the end. An error on any rank ends it on all.
class Follower : public Work {
  public:
    /// Call it while rank 0 calls Run::open(). Errors: the same on all ranks, that of the first which fails,
    /// "rank 2: ..."; kInvalidArgument for what differs from rank 0.
    ///
    /// Raising `interrupt`, which must outlive the run like the group, has rank 0 end it.
    static Result<std::unique_ptr<Follower>> open(Group& group, const std::string& library,
                                                  std::unique_ptr<Task> task,
                                                  const Interrupt& interrupt);

    /// Waits for an order of rank 0, unless a step is still to be told.
    Status next(Event& event) override;
    [[nodiscard]] Figures figures() const override;

  private:
    Follower(Group& group, std::unique_ptr<Task> task, const Interrupt& interrupt)
        : group_(group), task_(std::move(task)), interrupt_(interrupt) {}
    /// Follow one order.
    Status obey();
    Status carry_out(const Order& order);
    Status begin(const Order& order);
    void after_step(const Step& done, Event& event);
    [[nodiscard]] double seconds() const { return begun_ ? begun_->seconds() : 0; }

    Group& group_;
    std::unique_ptr<Task> task_;
    Plan plan_;
    RankFacts facts_;
    Messages ignored_;  ///< rank 0 has the same
    bool opened_ = false;
    Status failed_;  ///< what next() gives from then on
    std::optional<EventKind> ended_;
    std::string ended_text_;
    std::deque<Step> done_;                                ///< steps that are still to be told
    std::uint64_t step_ = 0, attempts_ = 0, skipped_ = 0;  ///< counts of what was told
    double loss_ = NAN;
    std::optional<Numbers> ledger_;
    std::optional<Stopwatch> begun_;  ///< since the first step of this process
    std::uint64_t begun_at_ = 0;
    const Interrupt& interrupt_;
    const std::uint64_t raised_before_ = interrupt_.count();
};

}  // namespace splat::run
