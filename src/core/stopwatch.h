#pragma once

#include <chrono>

namespace splat {

/// Wall time, in seconds.
class Stopwatch {
  public:
    /// Since it was made, or since the last lap.
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(Clock::now() - last_).count();
    }
    /// The same, and begin the next lap.
    double lap() {
        const Clock::time_point now = Clock::now();
        const double passed = std::chrono::duration<double>(now - last_).count();
        last_ = now;
        return passed;
    }

  private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point last_ = Clock::now();
};

}  // namespace splat
