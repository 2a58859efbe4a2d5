#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "vkrun/config/image_channels.h"
#include "vkrun/data/view_source.h"

namespace vkrun {

/// The numbers of one splat_trainer_batch.
struct Batch {
    std::vector<float> images, view_to_world, quaternions, focals, targets;
    std::vector<splat_camera> cameras;
    std::vector<std::string> names;  ///< of the objects
    std::uint32_t channels = 0;      ///< of the images

    [[nodiscard]] splat_trainer_batch desc() const;
};

struct BatchShape {
    std::uint32_t objects = 0;  ///< per batch
    std::uint32_t views = 0;    ///< input images of each
    std::uint32_t targets = 0;  ///< images to render, the input images first
    std::uint64_t seed = 0;
    bool focals = false;  ///< each view has its own
};

/// The batches of a training. Batch `n` depends on the seed and n alone. Each pass over the objects has
/// its own order, and each visit of an object chooses its views at random.
class BatchSource {
  public:
    BatchSource(const ViewSource& data, const ImageChannels& channels, const BatchShape& shape)
        : data_(data), channels_(channels), shape_(shape) {}

    [[nodiscard]] Batch make(std::uint64_t n) const;

  private:
    [[nodiscard]] std::uint32_t object_at(std::uint64_t position) const;

    const ViewSource& data_;
    ImageChannels channels_;
    BatchShape shape_;
};

/// Makes batches ahead of time in its own thread.
class Prefetch {
  public:
    Prefetch(const BatchSource& source, std::uint64_t first, std::size_t ahead);
    ~Prefetch();
    Prefetch(const Prefetch&) = delete;
    Prefetch& operator=(const Prefetch&) = delete;

    /// The next batch. Throws what the source threw.
    Batch next();

  private:
    void run();

    const BatchSource& source_;
    std::uint64_t at_;
    std::size_t ahead_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Batch> ready_;
    std::exception_ptr failed_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace vkrun
