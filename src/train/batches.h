#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "config/config_keys.h"
#include "core/fork.h"
#include "predict/view_source.h"
#include "scene/camera.h"
#include "train/object_order.h"
#include "train/trainer.h"

namespace splat::train {

/// The arrays of one TrainBatch.
struct Batch {
    std::vector<float> images, view_to_world, quaternions, focals, embedding, tokens, planes;
    std::vector<float> targets;  ///< where opt.target_resolution is not the network's; else levels
    std::vector<std::uint8_t> levels;
    std::vector<scene::Camera> cameras;

    [[nodiscard]] TrainBatch view() const;
};

/// The batches of a training. Batch `n` depends on the seed and n alone. Each pass over the objects has
/// its own order, and each visit of an object chooses its views at random.
class BatchSource {
  public:
    /// Make only the objects first ... first + count - 1 of each batch, as a rank needs them; 0 of them: all.
    BatchSource(std::shared_ptr<const predict::ViewSource> data, const config::Settings& settings,
                std::uint64_t seed, std::uint32_t first = 0, std::uint32_t count = 0);

    /// Let batch `n` begin with this object of the sequence of all, of which batch 0 otherwise has the first.
    void begin_at(std::uint64_t n, std::uint64_t object) {
        begin_ = n;
        begin_object_ = object;
    }
    [[nodiscard]] std::uint64_t object_of(std::uint64_t n) const {
        return begin_object_ + (n - begin_) * objects_;
    }

    /// Errors: kFormat, naming an object with too few views.
    [[nodiscard]] Status check() const;

    /// Thread-safe. Errors: those of ViewSource::read.
    [[nodiscard]] Result<Batch> make(std::uint64_t n) const;

  private:
    Status add_object(std::uint64_t position, Batch& batch) const;
    void add_targets(std::span<const std::uint8_t> levels, std::span<const scene::Camera> cameras,
                     Batch& batch) const;

    std::shared_ptr<const predict::ViewSource> data_;
    std::uint32_t objects_;        ///< per batch
    std::uint32_t first_, count_;  ///< the objects to make
    std::uint32_t views_;          ///< input images of each
    std::uint32_t targets_;        ///< images to render, the input images first
    std::uint32_t shrink_;         ///< pixels of an image for one of a target, on a side
    std::uint64_t seed_;
    std::uint64_t begin_ = 0, begin_object_ = 0;  ///< see begin_at()
    ObjectOrder order_;
    bool focals_;  ///< each view has its own
};

class Prefetch;

/// Ends a Prefetch, except in a forked child, which does not have its threads.
struct PrefetchEnd {
    void operator()(Prefetch* prefetch) const;
};
using PrefetchPointer = std::unique_ptr<Prefetch, PrefetchEnd>;

/// How many threads are to make batches: opt.num_workers, else one beside a device that is the CPU, and on other
/// machines one less than there are cores, up to kMostHostThreads.
std::size_t loader_threads(const config::TrainConfig& config, bool cpu_device);

/// Makes batches ahead of time, one more than it has threads.
class Prefetch {
  public:
    /// Fewer threads if the system has no more. Errors: kOutOfHostMemory if it has none.
    static Result<PrefetchPointer> create(BatchSource source, std::size_t threads);
    ~Prefetch();
    Prefetch(const Prefetch&) = delete;
    Prefetch& operator=(const Prefetch&) = delete;

    /// Batch n. Fast where n follows the number of the call before; after an error, the next call tries again.
    /// Errors: those of BatchSource::make; kInvalidState in a forked child.
    Result<Batch> get(std::uint64_t n);

    [[nodiscard]] bool forked() const { return forks_ != fork_generation(); }

  private:
    Prefetch(BatchSource source, std::size_t threads)
        : source_(std::move(source)), ahead_(threads + 1) {}
    void run();
    /// Let go of all batches, also of those in the making.
    void clear();

    BatchSource source_;
    std::size_t ahead_;
    const std::uint32_t forks_ = fork_generation();
    std::mutex mutex_;  ///< guards the members below
    std::condition_variable changed_;
    /// Batches from number `next_` on, those in the making without a value. Errors are given in their turn.
    std::deque<std::optional<Result<Batch>>> window_;
    std::uint64_t next_ = 0;        ///< number of the next batch to give
    std::uint64_t generation_ = 0;  ///< counts clear(): what was in the making before is of no use
    bool idle_ = true;              ///< before the first call, and after an error
    bool stop_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace splat::train
