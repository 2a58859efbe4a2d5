#include "vk/pace.h"

#include <algorithm>
#include <cmath>

namespace splat::vk {
namespace {

// A desktop's watchdog ends a submit of a few seconds; shorter ones also keep a shared machine responsive. CPU devices
// have no watchdog, and the system shares them by itself: longer segments, for which only a cancelled call waits.
constexpr double kSubmitSeconds = 0.1;
constexpr double kCpuSubmitSeconds = 0.25;
constexpr double kLeastSubmitSeconds = 1e-3;

/// A kernel may be slower than estimated by as much before its first segment takes too long. A factor rises by no more
/// at once: a process that was stopped measures hours.
constexpr double kCaution = 32;
/// The time of a segment below this part of the longest says more of the submit than of the kernels, and it harms
/// nobody: no factor rises by it.
constexpr double kShort = 1.0 / 32;

}  // namespace

Pace::Pace(bool watched, double submit_seconds)
    : watched_(watched),
      submit_seconds_(submit_seconds > 0 ? std::max(submit_seconds, kLeastSubmitSeconds)
                      : watched          ? kSubmitSeconds
                                         : kCpuSubmitSeconds) {}

double Pace::planned(const KernelPace& kernel, int segments) const {
    if (!watched_) return kernel.factor;
    return std::max(kernel.factor, std::min(std::ldexp(kCaution, -segments), kernel.most));
}

bool Pace::learn(KernelPace& kernel, double seconds, double ratio) {
    if (kernel.seconds <= 0) return false;
    if (!kernel.bound) kernel.most = std::min(kernel.most, seconds / kernel.seconds);
    kernel.seconds = 0;
    const double before = kernel.factor;
    const bool is_short = seconds < kShort * submit_seconds_;
    if (ratio <= 1) {  // CPU devices keep the cautious estimate: their segments stay as they are
        const double least = watched_ && !kernel.bound ? kLeastFactor : 1.0;
        if (!kernel.bound || !is_short) kernel.factor = std::max(before * (1 + ratio) / 2, least);
    } else if (!is_short) {
        kernel.factor = before * std::min(ratio, kCaution);
    }
    changes_ += kernel.factor != before ? 1U : 0U;
    return kernel.factor > before;
}

}  // namespace splat::vk
