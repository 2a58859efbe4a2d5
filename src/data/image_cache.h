#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <vector>

#include "core/fork.h"

namespace splat::data {

/// Decoded images within a number of bytes; the least recently used are dropped. Thread-safe.
class ImageCache {
  public:
    using Pixels = std::shared_ptr<const std::vector<std::uint8_t>>;

    explicit ImageCache(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}

    /// Null if it is not cached.
    Pixels find(std::uint64_t key);

    /// Images larger than the cache, and a second image of a key, are not kept.
    void add(std::uint64_t key, Pixels pixels);

    [[nodiscard]] std::uint64_t bytes() const;

  private:
    struct Entry {
        std::uint64_t key = 0;
        Pixels pixels;
    };

    mutable ForkMutex mutex_;
    std::uint64_t max_bytes_;
    std::uint64_t bytes_ = 0;
    std::list<Entry> entries_;  ///< the most recently used first
    std::map<std::uint64_t, std::list<Entry>::iterator> places_;
};

}  // namespace splat::data
