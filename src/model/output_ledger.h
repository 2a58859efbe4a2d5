#pragma once

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

/// Counts on the device what Ledger holds: one list and one small read after each pass.
class OutputLedger {
  public:
    /// raw        the network's output
    /// Errors     kOutOfDeviceMemory
    static Result<OutputLedger> create(vk::Context& context, const vk::BufferView& raw,
                                       const gaussians::SetDesc& desc,
                                       const gaussians::SetViews& set);

    /// Errors: those of Context::run and read.
    Status measure(Ledger& ledger);

  private:
    explicit OutputLedger(vk::Context& context) : context_(&context) {}

    vk::Context* context_;
    vk::Buffer counts_;  ///< partial statistics of the set, then of the output
    vk::CommandList list_;
    std::uint64_t raw_offset_ = 0;  ///< bytes
    std::uint32_t gaussians_ = 0;
};

}  // namespace splat::model
