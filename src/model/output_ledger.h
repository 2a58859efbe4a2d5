#pragma once

#include <array>

#include "nn/executor.h"

namespace splat::model {

/// What a forward pass gave, over all objects of the batch.
struct Ledger {
    std::uint64_t gaussians = 0;
    /// Numbers of the network's output and of the attributes that are NaN or infinite. Heads clamp some.
    std::uint64_t non_finite = 0;
    std::uint64_t faint = 0;  ///< Gaussians of an opacity below 1/255, which no pixel shows
};

/// Counts on the device what Ledger holds: one list and one small read after each pass.
class OutputLedger {
  public:
    /// results    the network's output, means, opacities, scales, rotations and sh
    /// Errors     kOutOfDeviceMemory
    static Result<OutputLedger> create(vk::Context& context,
                                       const std::array<vk::BufferView, 6>& results,
                                       const vk::BufferView& opacities);

    /// Errors: those of Context::run and read.
    Status measure(Ledger& ledger);

  private:
    explicit OutputLedger(vk::Context& context) : context_(&context) {}

    vk::Context* context_;
    vk::Buffer counts_;  ///< partial statistics of each tensor, then a copy of the opacities
    vk::CommandList list_;
    std::array<std::uint64_t, 6> offsets_{}, bytes_{};  ///< places of the statistics in counts_
    std::uint64_t opacities_offset_ = 0, opacities_ = 0;
};

}  // namespace splat::model
