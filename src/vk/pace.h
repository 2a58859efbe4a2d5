#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <map>
#include <string>

namespace splat::vk {

/// What is known of the time that one kernel takes on one device.
struct KernelPace {
    double factor = 1;  ///< time measured / estimated
    /// The factor is not above this: a segment with the kernel took no longer as a whole.
    double most = std::numeric_limits<double>::infinity();
    bool bound =
        false;  ///< work is estimated by capacity, so a short time tells nothing of the pace

    double seconds = 0;          ///< estimated, in the segment that is learnt from
    int segments = 0;            ///< with the kernel, in the list that is cut
    std::size_t in_segment = 0;  ///< number of the latest of these, from 1
};

/// Times of segments, measured on one device, and how long a segment may take. Guarded as the context is.
///
/// Segments are planned by the estimates of recorder.h, corrected by a factor for each kernel. Where a watchdog may end
/// a submit that is too long, a kernel of which nothing is known gets 1/32 of a segment, and twice as much in each
/// segment after; a factor rises at once and falls slowly.
class Pace {
  public:
    /// Factors do not fall below this, as work is estimated roughly; those of KernelPace::bound not below 1. On the
    /// fastest devices segments are shorter than they might be, but still long beside a submit of 20 us.
    static constexpr double kLeastFactor = 0.25;

    /// `watched`: not a CPU device. `submit_seconds`: 0 = 0.1 s, on CPU devices 0.25 s; at least 1 ms.
    explicit Pace(bool watched = true, double submit_seconds = 0);

    [[nodiscard]] bool watched() const { return watched_; }
    [[nodiscard]] double submit_seconds() const { return submit_seconds_; }

    /// What is known of a kernel, by the name of its module. The reference lives as long as this object.
    KernelPace& of(const std::string& kernel) { return kernels_[kernel]; }

    /// Factor by which a kernel is planned if `segments` before it in the list have the kernel.
    [[nodiscard]] double planned(const KernelPace& kernel, int segments) const;

    /// Learn from a segment of `seconds` in which `kernel` has work of KernelPace::seconds, which become 0. `ratio`:
    /// the time of the segment, by that expected; its kernels share the error in proportion. True if the factor rose.
    bool learn(KernelPace& kernel, double seconds, double ratio);

    /// Note a submit of so many estimated seconds, by no factor.
    void submitted(double seconds) { longest_ = std::max(longest_, seconds); }
    /// The longest of them.
    [[nodiscard]] double longest_estimate() const { return longest_; }

    /// Number of changes of factors.
    [[nodiscard]] std::uint64_t changes() const { return changes_; }

    std::chrono::steady_clock::time_point (*now)() =
        &std::chrono::steady_clock::now;  ///< tests replace it

  private:
    bool watched_;
    double submit_seconds_;
    double longest_ = 0;
    std::uint64_t changes_ = 0;
    std::map<std::string, KernelPace> kernels_;
};

}  // namespace splat::vk
