#pragma once

#include <atomic>
#include <cstdint>

#include "core/no_copy.h"

namespace splat {

/// A count that any thread, and any signal handler, raises by a number such as a handle.
class Interrupt : NoCopy {
  public:
    Interrupt();
    ~Interrupt();

    /// From now on raise(key, kind) finds it; 0 hides it. `kind` lives as long as the process and is
    /// compared by its address.
    void name(std::uintptr_t key, const char* kind) noexcept;

    void raise() noexcept;
    /// Compare two of them: the first is not always zero.
    [[nodiscard]] std::uint64_t count() const noexcept;

    /// Raise the one of that name: atomics only. Returns false if there is none.
    static bool raise(std::uintptr_t key, const char* kind) noexcept;

  private:
    struct Slot;
    Slot* slot_;
};

}  // namespace splat
