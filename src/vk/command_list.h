#pragma once

#include <memory>
#include <vector>

#include "vk/command.h"

namespace splat::vk {

class Context;

/// A recorded list of commands, submitted any number of times. Only contents of buffers change between runs.
///
/// Keeps no buffer alive: the owners of its views must outlive its last run.
class CommandList {
  public:
    CommandList() = default;

    /// Builds descriptor sets and command buffers. Errors: the driver's.
    static Result<CommandList> create(Context& context, std::vector<Command> commands);

    /// Once command `first` has begun, a run is not cancelled.
    void set_whole_from(std::size_t first);

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
