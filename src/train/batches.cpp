#include "train/batches.h"

#include <algorithm>
#include <system_error>

#include "core/float_mode.h"
#include "core/parallel.h"

namespace splat::train {
namespace {

void append(std::vector<float>& to, const std::vector<float>& from, std::size_t count) {
    to.insert(to.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace

TrainBatch Batch::view() const {
    TrainBatch batch;
    batch.images = images;
    batch.view_to_world = view_to_world;
    batch.quaternions = quaternions;
    batch.focals = focals;
    batch.embedding = embedding;
    batch.tokens = tokens;
    batch.planes = planes;
    batch.targets = targets;
    batch.levels = levels;
    batch.cameras = cameras;
    return batch;
}

BatchSource::BatchSource(std::shared_ptr<const predict::ViewSource> data,
                         const config::Settings& settings, std::uint64_t seed, std::uint32_t first,
                         std::uint32_t count)
    : data_(std::move(data)),
      objects_(settings.training.batch_size),
      first_(first),
      count_(count == 0 ? objects_ : count),
      views_(settings.network.views),
      targets_(settings.training.targets),
      shrink_(settings.training.target_resolution == 0
                  ? 1
                  : data_->resolution() / settings.training.target_resolution),
      seed_(seed),
      order_(data_->objects(), seed),
      focals_(settings.network.fov_degrees == 0) {}

Status BatchSource::check() const {
    if (data_->objects() == 0) return damaged("the data set has no objects");
    for (std::uint32_t i = 0; i < data_->objects(); ++i)
        if (data_->views_of(i) < views_ + 1)
            return damaged("object '%s' has %u views, expected at least %u", data_->name(i).c_str(),
                           data_->views_of(i), views_ + 1);
    return {};
}

Result<Batch> BatchSource::make(std::uint64_t n) const {
    Batch batch;
    for (std::uint32_t i = first_; i < first_ + count_; ++i)
        SPLAT_TRY(add_object(object_of(n) + i, batch));
    return batch;
}

Status BatchSource::add_object(std::uint64_t position, Batch& batch) const {
    const std::uint32_t object = order_.at(position);
    const std::vector<std::uint32_t> order =
        permutation(data_->views_of(object), seed_, 2 * position + 1);
    // The first views are both inputs and targets; if there are too few, they repeat.
    std::vector<std::uint32_t> numbers(order.begin(), order.begin() + views_);
    for (std::uint32_t t = 0; t < targets_; ++t) numbers.push_back(order[t % order.size()]);
    SPLAT_ASSIGN(const predict::Views views, data_->read(object, numbers, views_, true));
    append(batch.images, views.inputs, views.inputs.size());
    append(batch.view_to_world, views.view_to_world, std::size_t{16} * views_);
    append(batch.quaternions, views.quaternions, std::size_t{4} * views_);
    if (focals_) append(batch.focals, views.focals, std::size_t{2} * views_);
    append(batch.embedding, views.embedding, views.embedding.size());
    append(batch.tokens, views.tokens, views.tokens.size());
    append(batch.planes, views.planes, views.planes.size());
    const std::size_t plane = views.levels.size() / numbers.size();
    add_targets(std::span(views.levels).subspan(plane * views_),
                std::span(views.cameras).subspan(views_), batch);
    return {};
}

void BatchSource::add_targets(std::span<const std::uint8_t> levels,
                              std::span<const scene::Camera> cameras, Batch& batch) const {
    const std::size_t first = batch.cameras.size();
    batch.cameras.insert(batch.cameras.end(), cameras.begin(), cameras.end());
    if (shrink_ == 1) {
        batch.levels.insert(batch.levels.end(), levels.begin(), levels.end());
        return;
    }
    for (scene::Camera& camera : std::span(batch.cameras).subspan(first)) {
        camera.width /= shrink_;
        camera.height /= shrink_;
        for (double* const length : {&camera.fx, &camera.fy, &camera.cx, &camera.cy})
            *length /= shrink_;
    }
    const std::size_t side = data_->resolution();
    const std::size_t rows = levels.size() / side;
    const auto area = static_cast<float>(255 * shrink_ * shrink_);
    for (std::size_t row = 0; row < rows; row += shrink_)
        for (std::size_t column = 0; column < side; column += shrink_) {
            std::uint32_t sum = 0;
            for (std::size_t i = 0; i < std::size_t{shrink_} * shrink_; ++i)
                sum += levels[(row + i / shrink_) * side + column + i % shrink_];
            batch.targets.push_back(static_cast<float>(sum) / area);
        }
}

void PrefetchEnd::operator()(Prefetch* prefetch) const {
    if (!prefetch->forked()) delete prefetch;
}

std::size_t loader_threads(const config::TrainConfig& config, bool cpu_device) {
    if (config.loader_threads > 0) return config.loader_threads;
    const std::size_t cores = std::thread::hardware_concurrency();
    return cpu_device || cores < 2 ? 1 : std::min(cores - 1, kMostHostThreads);
}

Result<PrefetchPointer> Prefetch::create(BatchSource source, std::size_t threads) {
    PrefetchPointer self(new Prefetch(std::move(source), threads));
    try {
        while (self->threads_.size() < threads)
            self->threads_.emplace_back([made = self.get()] { made->run(); });
    } catch (const std::system_error&) {
        if (self->threads_.empty()) return no_thread("reading batches");
    }
    return self;
}

Prefetch::~Prefetch() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

void Prefetch::clear() {
    window_.clear();
    ++generation_;
}

Result<Batch> Prefetch::get(std::uint64_t n) {
    if (forked())
        return bad_state(
            "this process was forked from the one that made the batches: make them in "
            "the child, or start children with spawn");
    std::unique_lock lock(mutex_);
    if (n != next_ || (idle_ && window_.empty())) {
        clear();
        next_ = n;
        idle_ = false;
        changed_.notify_all();
    }
    changed_.wait(lock, [this] { return !window_.empty() && window_.front(); });
    Result<Batch> batch = std::move(*window_.front());
    window_.pop_front();
    ++next_;
    if (!batch.ok()) clear();
    changed_.notify_all();
    return batch;
}

void Prefetch::run() {
    const FloatMode mode;  // threads of Windows start in another one
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return stop_ || (!idle_ && window_.size() < ahead_); });
        if (stop_) return;
        const std::uint64_t n = next_ + window_.size();
        const std::uint64_t generation = generation_;
        window_.emplace_back();
        lock.unlock();
        Result<Batch> made = Status(Code::kOutOfHostMemory, "no memory for a batch");
        try {
            made = source_.make(n);
        } catch (const std::exception&) {  // an allocation failed: the result stays
        }
        lock.lock();
        if (generation != generation_) continue;
        if (!made.ok()) idle_ = true;
        window_[n - next_] = std::move(made);
        changed_.notify_all();
    }
}

}  // namespace splat::train
