#pragma once

#include <memory>
#include <vector>

#include "vk/command.h"

namespace splat::vk {

class Context;

/// A recorded list of commands, submitted any number of times. Only push data and buffer contents
/// change between runs.
///
/// Keeps no buffer alive: the owners of its views must outlive its last run.
class CommandList {
  public:
    CommandList() = default;

    /// Builds descriptor sets and command buffers. Errors: the driver's.
    static Result<CommandList> create(Context& context, std::vector<Command> commands);

    /// Replace the push constants of the i-th dispatch (as Recorder::last_dispatch counted); in
    /// force from the next run.
    template <class Params>
    Status set_push(std::size_t dispatch, const Params& params) {
        return set_push_data(dispatch, PushData(params));
    }
    Status set_push_data(std::size_t dispatch, const PushData& push);

    [[nodiscard]] bool empty() const { return objects_ == nullptr; }
    [[nodiscard]] const std::vector<Command>& commands() const;
    /// In what pieces, and how many submits, the next run begins. A run may change the rest of its cut.
    [[nodiscard]] const std::vector<Piece>& pieces() const;
    [[nodiscard]] std::size_t submit_count() const;

  private:
    friend class Queue;
    struct Objects;
    std::shared_ptr<Objects> objects_;
};

}  // namespace splat::vk
