#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

namespace splat::data {

/// Decoded images, of which the ones not used for longest are given up when they take too much room.
/// Thread-safe.
class ImageCache {
  public:
    using Pixels = std::shared_ptr<const std::vector<std::uint8_t>>;

    explicit ImageCache(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}

    /// Empty if it is not there.
    Pixels find(std::uint64_t key);

    /// What is larger than the cache is not kept. The second of two images of one key is passed over.
    void add(std::uint64_t key, Pixels pixels);

    [[nodiscard]] std::uint64_t bytes() const;

  private:
    struct Entry {
        std::uint64_t key = 0;
        Pixels pixels;
    };

    mutable std::mutex mutex_;
    std::uint64_t max_bytes_;
    std::uint64_t bytes_ = 0;
    std::list<Entry> entries_;  ///< the latest used is the first
    std::map<std::uint64_t, std::list<Entry>::iterator> places_;
};

}  // namespace splat::data
