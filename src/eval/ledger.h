#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "model/output_ledger.h"

namespace splat::eval {

/// What of a prediction and of its images is finite and visible.
struct Ledger {
    std::uint64_t outputs_not_finite = 0;    ///< numbers that the network put out
    std::uint64_t gaussians = 0;             ///< predicted
    std::uint64_t gaussians_not_finite = 0;  ///< with a NaN or an infinity; no image shows them
    std::uint64_t invisible = 0;             ///< opacity below 1/255
    std::uint64_t visible = 0;               ///< all others
    std::uint64_t images_not_finite = 0;     ///< scored images with a NaN or an infinity
    std::uint64_t images_blank = 0;          ///< images that show the background only

    /// Without numbers that are not finite. Otherwise scores mean nothing.
    [[nodiscard]] bool finite() const {
        return outputs_not_finite == 0 && gaussians_not_finite == 0 && images_not_finite == 0;
    }
    void add(const Ledger& other);
    /// Take over the counts of a prediction.
    void take(const model::Ledger& prediction);
};

/// The counts of a ledger by the names that files give them.
inline constexpr struct {
    const char* name;
    std::uint64_t Ledger::*count;
} kLedgerCounts[] = {{"outputs_not_finite", &Ledger::outputs_not_finite},
                     {"gaussians", &Ledger::gaussians},
                     {"gaussians_not_finite", &Ledger::gaussians_not_finite},
                     {"gaussians_invisible", &Ledger::invisible},
                     {"gaussians_visible", &Ledger::visible},
                     {"images_not_finite", &Ledger::images_not_finite},
                     {"images_blank", &Ledger::images_blank}};

/// True if an image [3,pixels] has one colour everywhere.
bool is_plain(std::span<const float> image, const std::array<float, 3>& colour);

}  // namespace splat::eval
