#pragma once

#include <functional>

#include "core/fork.h"
#include "run/order.h"

namespace splat::run {

/// Leads the other ranks of a run. Without others it does rank 0's part alone.
///
/// Errors       that of any rank, on all of them; it ends the run, and all later calls give it
class Leader : NoCopy {
  public:
    explicit Leader(Group* group)
        : group_(group != nullptr && group->count() > 1 ? group : nullptr) {}
    ~Leader();

    [[nodiscard]] bool alone() const { return group_ == nullptr; }
    /// OK while the run of several ranks goes on.
    [[nodiscard]] const Status& failed() const { return failed_; }
    /// Whether another rank was asked to end the run.
    [[nodiscard]] bool interrupted() const { return interrupted_; }

    /// Refuse ranks of another version. Call it first.
    Status greet(const std::string& library);
    /// Do rank 0's part while others follow the order.
    Status together(Order order, const std::function<Status()>& mine);
    /// Compare facts of prepared tasks.
    Status compare(Task& task, Messages& messages);
    /// Load a state on all ranks. An error, except of the group, does not end the run.
    Status load(const io::WeightsFile& state, Task& task);
    /// Tell others that the run has ended and everything is saved.
    Status end(std::int32_t kind, const std::string& text);
    /// Tell others of an error that they do not know, which ends the run.
    void fail(const Status& status);

  private:
    Group* group_;
    Status failed_;
    std::string agreed_;  ///< latest error that all ranks know
    bool over_ = false;   ///< others expect no more orders
    bool interrupted_ = false;
    const std::uint32_t forks_ = fork_generation();
};

}  // namespace splat::run
