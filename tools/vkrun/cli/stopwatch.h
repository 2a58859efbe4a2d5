#pragma once

#include <chrono>

namespace vkrun {

/// Wall time since it was made.
class Stopwatch {
  public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }
    [[nodiscard]] double ms() const { return 1e3 * seconds(); }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Wall time of a call, ms.
template <class Call>
double timed_ms(Call&& call) {
    const Stopwatch watch;
    call();
    return watch.ms();
}

}  // namespace vkrun
