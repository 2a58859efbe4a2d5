#include "eval/ledger.h"

namespace splat::eval {

void Ledger::add(const Ledger& other) {
    for (const auto& [name, count] : kLedgerCounts) this->*count += other.*count;
}

void Ledger::take(const model::Ledger& prediction) {
    outputs_not_finite = prediction.outputs_not_finite;
    gaussians = prediction.gaussians;
    gaussians_not_finite = prediction.set.not_finite;
    invisible = prediction.set.invisible;
    visible = gaussians - gaussians_not_finite - invisible;
}

bool is_plain(std::span<const float> image, const std::array<float, 3>& colour) {
    const std::size_t pixels = image.size() / 3;
    for (std::size_t channel = 0; channel < 3; ++channel)
        for (const float value : image.subspan(channel * pixels, pixels))
            if (value != colour[channel]) return false;
    return true;
}

}  // namespace splat::eval
