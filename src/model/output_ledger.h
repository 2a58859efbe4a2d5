#pragma once

#include <memory>
#include <mutex>
#include <span>

#include "gaussians/set_statistics.h"
#include "nn/executor.h"

namespace splat::model {

/// What a forward pass gave, over all objects of the batch.
struct Ledger {
    std::uint64_t gaussians = 0;
    std::uint64_t outputs_not_finite = 0;  ///< numbers of the network's output; heads clamp some
    gaussians::SetStatistics set;

    /// Numbers of the network's output and of the attributes that are NaN or infinite.
    [[nodiscard]] std::uint64_t non_finite() const {
        return outputs_not_finite + set.numbers_not_finite;
    }
};

/// Counts on the device what Ledger holds: one list after each pass.
class OutputLedger {
  public:
    /// raw        the network's output
    /// Errors     kOutOfDeviceMemory
    static Result<OutputLedger> create(vk::Context& context, const vk::BufferView& raw,
                                       const gaussians::SetDesc& desc,
                                       const gaussians::SetViews& set);

    /// Fill counts(). Errors: those of Context::run.
    Status measure() { return context_->run(list_); }

    /// What the latest measure() counted.
    [[nodiscard]] const vk::BufferView& counts() const { return counts_.range(); }

    /// The ledger by the numbers of counts(): from now on the latest().
    Ledger take(std::span<const std::uint32_t> counts);

    /// Thread-safe.
    [[nodiscard]] Ledger latest() const {
        const std::lock_guard lock(*mutex_);
        return latest_;
    }

  private:
    explicit OutputLedger(vk::Context& context) : context_(&context) {}

    vk::Context* context_;
    vk::Buffer counts_;  ///< partial statistics of the set, then of the output
    vk::CommandList list_;
    std::uint64_t raw_offset_ = 0;  ///< bytes
    std::uint32_t gaussians_ = 0;
    std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  ///< guards latest_
    Ledger latest_;
};

}  // namespace splat::model
