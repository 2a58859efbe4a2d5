#pragma once

#include <cfenv>

#include "core/no_copy.h"

namespace splat {

/// While it lives, this thread computes as a C program does at its start: rounds to nearest, keeps numbers below the
/// least normal one, traps nothing. A caller's mode may differ, by -ffast-math, fesetround() or feenableexcept(), and
/// comes back at the end, with the exceptions that the caller had found. Threads start in the mode of their maker.
class FloatMode : NoCopy {
  public:
    FloatMode() noexcept;
    ~FloatMode() { end(); }

    /// Go back to the caller's mode before the end.
    void end() noexcept {
        if (differs_) std::fesetenv(&callers_);
        differs_ = false;
    }

  private:
    std::fenv_t callers_;  ///< only if it differs
    bool differs_;
};

/// The mode of a thread now, in which others' functions can be called later.
class CallersFloatMode {
  public:
    CallersFloatMode() noexcept { std::fegetenv(&mode_); }

    /// Return what a function returns, which runs in that mode.
    template <class Function>
    auto call(Function&& function) const {
        const CallersFloatMode now;
        std::fesetenv(&mode_);
        const auto returned = function();
        std::fesetenv(&now.mode_);
        return returned;
    }

  private:
    std::fenv_t mode_;
};

}  // namespace splat
