#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace splat::train {

/// 0 ... count - 1 in a random order that is the same for the same numbers.
std::vector<std::uint32_t> permutation(std::uint32_t count, std::uint64_t seed,
                                       std::uint64_t stream);

/// The order of objects in each pass over them. Thread-safe; copies share their lists.
///
/// Up to data::kMostListed objects have a list, made once a pass. Of more, each place is computed by itself: a Feistel
/// network of the bits that `count` needs permutes those numbers, and is applied until the result is below `count`,
/// twice at most on average (Black and Rogaway 2002, "Ciphers with arbitrary finite domains", their cycle-walking).
class ObjectOrder {
  public:
    ObjectOrder(std::uint32_t count, std::uint64_t seed);

    /// The object at this position: pass * count + place.
    [[nodiscard]] std::uint32_t at(std::uint64_t position) const;

  private:
    struct Pass {
        std::uint64_t number = ~std::uint64_t{0};
        std::vector<std::uint32_t> order;
    };
    /// Passes of an even and an odd number: threads make batches on both sides of a pass's end.
    struct Lists {
        std::mutex mutex;
        std::array<Pass, 2> passes;
    };
    [[nodiscard]] std::uint32_t listed(std::uint64_t pass, std::uint32_t place) const;
    [[nodiscard]] std::uint32_t computed(std::uint64_t pass, std::uint32_t place) const;

    std::uint32_t count_;
    std::uint64_t seed_;
    std::shared_ptr<Lists> lists_;
};

}  // namespace splat::train
