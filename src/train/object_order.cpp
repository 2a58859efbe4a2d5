#include "train/object_order.h"

#include <bit>
#include <numeric>

#include "data/dataset.h"

namespace splat::train {
namespace {

/// Rounds of the network; Black and Rogaway's proof needs 3, each further one mixes more.
constexpr std::size_t kRounds = 8;

/// splitmix64: numbers from a state that is a number (Steele et al. 2014, "Fast splittable
/// pseudorandom number generators").
std::uint64_t next_random(std::uint64_t& state) {
    state += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31U);
}

/// The state that a stream of a seed begins with.
std::uint64_t state_of(std::uint64_t seed, std::uint64_t stream) {
    std::uint64_t state = seed;
    return next_random(state) ^ stream;
}

/// Even streams are orders of objects, odd ones orders of views.
std::uint64_t stream_of(std::uint64_t pass) {
    return 2 * pass;
}

}  // namespace

std::vector<std::uint32_t> permutation(std::uint32_t count, std::uint64_t seed,
                                       std::uint64_t stream) {
    std::uint64_t state = state_of(seed, stream);
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0U);
    for (std::uint32_t i = count; i > 1; --i)
        std::swap(order[i - 1], order[next_random(state) % i]);
    return order;
}

ObjectOrder::ObjectOrder(std::uint32_t count, std::uint64_t seed)
    : count_(count), seed_(seed), lists_(std::make_shared<Lists>()) {}

std::uint32_t ObjectOrder::at(std::uint64_t position) const {
    const std::uint64_t pass = position / count_;
    const auto place = static_cast<std::uint32_t>(position % count_);
    return count_ <= data::kMostListed ? listed(pass, place) : computed(pass, place);
}

std::uint32_t ObjectOrder::listed(std::uint64_t pass, std::uint32_t place) const {
    const std::lock_guard lock(lists_->mutex);
    Pass& kept = lists_->passes[pass % 2];
    if (kept.number != pass || kept.order.empty()) {
        kept.order = permutation(count_, seed_, stream_of(pass));
        kept.number = pass;
    }
    return kept.order[place];
}

std::uint32_t ObjectOrder::computed(std::uint64_t pass, std::uint32_t place) const {
    std::uint64_t state = state_of(seed_, stream_of(pass));
    std::array<std::uint64_t, kRounds> keys{};
    for (std::uint64_t& key : keys) key = next_random(state);
    const int bits = std::bit_width(count_ - 1);
    const int low_bits = bits / 2;
    const std::uint32_t low_mask = (1U << low_bits) - 1, high_mask = (1U << (bits - low_bits)) - 1;
    std::uint32_t value = place;
    do {
        std::uint32_t low = value & low_mask, high = value >> low_bits;
        for (std::size_t round = 0; round < kRounds; ++round) {
            std::uint64_t mixed = keys[round] + (round % 2 == 0 ? high : low);
            const auto bits_of_round = static_cast<std::uint32_t>(next_random(mixed));
            if (round % 2 == 0)
                low ^= bits_of_round & low_mask;
            else
                high ^= bits_of_round & high_mask;
        }
        value = high << low_bits | low;
    } while (value >= count_);
    return value;
}

}  // namespace splat::train
