#pragma once

namespace splat {

/// Base of what is neither copied nor moved.
struct NoCopy {
    NoCopy() = default;
    NoCopy(const NoCopy&) = delete;
    NoCopy& operator=(const NoCopy&) = delete;
};

}  // namespace splat
