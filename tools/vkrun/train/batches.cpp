#include "vkrun/train/batches.h"

#include <algorithm>
#include <numeric>

#include "vkrun/cli/handles.h"

namespace vkrun {
namespace {

/// splitmix64: numbers from a state that is a number (Steele et al. 2014, "Fast splittable
/// pseudorandom number generators").
std::uint64_t next_random(std::uint64_t& state) {
    state += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31U);
}

/// 0 ... count - 1 in a random order that is the same for the same numbers.
std::vector<std::uint32_t> permutation(std::uint32_t count, std::uint64_t seed,
                                       std::uint64_t stream) {
    std::uint64_t state = seed;
    state = next_random(state) ^ stream;
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0U);
    for (std::uint32_t i = count; i > 1; --i)
        std::swap(order[i - 1], order[next_random(state) % i]);
    return order;
}

void append(std::vector<float>& to, const std::vector<float>& from, std::size_t count) {
    to.insert(to.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace

splat_trainer_batch Batch::desc() const {
    auto batch = sized<splat_trainer_batch>();
    batch.images = images.data();
    batch.view_to_world = view_to_world.data();
    batch.quaternions = quaternions.data();
    if (!focals.empty()) batch.focals = focals.data();
    batch.targets = targets.data();
    batch.cameras = cameras.data();
    batch.channels = channels;
    return batch;
}

std::uint32_t BatchSource::object_at(std::uint64_t position) const {
    const std::uint32_t count = data_.objects();
    // Even streams are orders of objects, odd ones orders of views.
    return permutation(count, shape_.seed, 2 * (position / count))[position % count];
}

Batch BatchSource::make(std::uint64_t n) const {
    Batch batch;
    batch.channels = channels_.count();
    for (std::uint32_t i = 0; i < shape_.objects; ++i) {
        const std::uint64_t position = n * shape_.objects + i;
        const std::uint32_t object = object_at(position);
        std::vector<std::uint32_t> order =
            permutation(data_.views_of(object), shape_.seed, 2 * position + 1);
        // The first views are both inputs and targets; if there are too few, they repeat.
        std::vector<std::uint32_t> numbers(order.begin(), order.begin() + shape_.views);
        for (std::uint32_t t = 0; t < shape_.targets; ++t)
            numbers.push_back(order[t % order.size()]);
        const Views views = data_.read(object, numbers, shape_.views, channels_);
        append(batch.images, views.inputs, views.inputs.size());
        append(batch.view_to_world, views.view_to_world, std::size_t{16} * shape_.views);
        append(batch.quaternions, views.quaternions, std::size_t{4} * shape_.views);
        if (shape_.focals) append(batch.focals, views.focals, std::size_t{2} * shape_.views);
        const std::size_t plane = views.images.size() / numbers.size();
        batch.targets.insert(
            batch.targets.end(),
            views.images.begin() + static_cast<std::ptrdiff_t>(plane * shape_.views),
            views.images.end());
        batch.cameras.insert(batch.cameras.end(), views.cameras.begin() + shape_.views,
                             views.cameras.end());
        batch.names.push_back(data_.name(object));
    }
    return batch;
}

Prefetch::Prefetch(const BatchSource& source, std::uint64_t first, std::size_t ahead)
    : source_(source), at_(first), ahead_(ahead), thread_([this] { run(); }) {}

Prefetch::~Prefetch() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

Batch Prefetch::next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !ready_.empty() || failed_ != nullptr; });
    if (ready_.empty()) std::rethrow_exception(failed_);
    Batch batch = std::move(ready_.front());
    ready_.pop_front();
    changed_.notify_all();
    return batch;
}

void Prefetch::run() {
    while (true) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return stop_ || ready_.size() < ahead_; });
        if (stop_) return;
        const std::uint64_t n = at_++;
        lock.unlock();
        Batch batch;
        std::exception_ptr failed;
        try {
            batch = source_.make(n);
        } catch (...) {
            failed = std::current_exception();
        }
        lock.lock();
        if (failed == nullptr)
            ready_.push_back(std::move(batch));
        else
            failed_ = failed;
        changed_.notify_all();
        if (failed_ != nullptr) return;
    }
}

}  // namespace vkrun
