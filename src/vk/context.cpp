#include "vk/context.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>
#include <vector>

#include "core/environment.h"
#include "core/fork.h"
#include "vk/watchdog.h"

namespace splat::vk {
namespace {

constexpr double kDefaultTimeoutNs = 60e9;
/// Piece of a staged transfer: large enough to hide the submit, small enough to keep the staging
/// block small.
constexpr std::uint64_t kStagingBytes = std::uint64_t{8} << 20;
constexpr std::uint64_t kLeastStagingBytes = std::uint64_t{64} << 10;

Result<std::uint64_t> timeout_of(const ContextDesc& desc) {
    SPLAT_ASSIGN(const double scale, environment_positive("SPLAT_TIMEOUT_SCALE", 1.0));
    const double wanted =
        desc.timeout_ns != 0 ? static_cast<double>(desc.timeout_ns) : kDefaultTimeoutNs;
    return static_cast<std::uint64_t>(std::clamp(wanted * scale, 1.0, 9e18));
}

/// Devices that hung or were lost, and that were opened anew.
struct Left {
    ForkMutex mutex;
    std::vector<std::shared_ptr<Context>> contexts;
};

}  // namespace

Result<std::shared_ptr<Context>> Context::create(const ContextDesc& desc) {
    SPLAT_ASSIGN(const std::uint64_t timeout_ns, timeout_of(desc));
    std::shared_ptr<Context> context(new Context);
    {
        const Watchdog watchdog("", "the opening of a Vulkan device", "");
        SPLAT_ASSIGN(context->device_, Device::create(desc.device));
    }
    Device& device = *context->device_;
    context->memory_ = std::make_unique<Memory>(device, desc.memory);
    context->device_now_ = context->device_.get();
    context->memory_now_ = context->memory_.get();
    context->pipelines_ = std::make_unique<Pipelines>(device, desc.cache_folder,
                                                      compile_threads(desc.device.validation));
    context->queue_ =
        std::make_unique<Queue>(device, *context->memory_, context->mutex, timeout_ns);
    context->desc_ = desc;
    context->desc_.device.select = DeviceSelect::kByIndex;
    context->desc_.device.index = device.info().index;
    context->timeout_ns_ = timeout_ns;
    context->profile_enabled_ = desc.profile;
    context->profile_levels_ = desc.profile_levels;
    return context;
}

Status Context::reopen() {
    SPLAT_ASSIGN(const std::shared_ptr<Context> other, create(desc_));
    auto queue = std::make_unique<Queue>(*other->device_, *other->memory_, mutex, timeout_ns_);
    Left& left = for_ever<Left>();
    const std::lock_guard lock(left.mutex);
    left.contexts.push_back(other);
    std::swap(device_, other->device_);
    std::swap(memory_, other->memory_);
    device_now_ = device_.get();
    memory_now_ = memory_.get();
    std::swap(pipelines_, other->pipelines_);
    std::swap(staging_, other->staging_);
    other->queue_ = std::exchange(queue_, std::move(queue));
    return {};
}

Context::~Context() {
    { const std::lock_guard last(mutex); }  // does the work that other threads left
    // First the queue, which waits for running work; then pipelines and memory; last the device.
    queue_.reset();
    pipelines_.reset();
    staging_.reset();
    memory_.reset();
}

/// A staging buffer of at least `bytes`, a power of two.
Status Context::reserve_staging(std::uint64_t bytes) {
    if (staging_ && staging_->range().bytes >= bytes) return {};
    staging_.reset();
    SPLAT_ASSIGN(Buffer made, memory_->allocate(std::bit_ceil(std::max(bytes, kLeastStagingBytes)),
                                                MemoryKind::kStaging, "staging buffer"));
    staging_.emplace(std::move(made));
    return {};
}

Status Context::transfer(const BufferView& view, std::byte* to, const std::byte* from,
                         std::uint64_t bytes) {
    SPLAT_TRY(reserve_staging(std::min(bytes, kStagingBytes)));
    for (std::uint64_t done = 0; done < bytes; done += kStagingBytes) {
        const std::uint64_t piece = std::min(kStagingBytes, bytes - done);
        BufferView stage = staging_->range();
        stage.bytes = piece;
        BufferView part = view;
        part.offset += done;
        part.bytes = piece;
        Recorder recorder(*this);
        if (from != nullptr) {
            std::memcpy(Memory::host(stage), from + done, piece);
            SPLAT_TRY(memory_->flush(stage));
            SPLAT_TRY(recorder.copy(stage, part));
        } else {
            SPLAT_TRY(recorder.copy(part, stage));
        }
        SPLAT_ASSIGN(CommandList list, recorder.finish());
        SPLAT_TRY(run(list));
        if (to == nullptr) continue;
        SPLAT_TRY(memory_->invalidate(stage));
        std::memcpy(to + done, Memory::host(stage), piece);
    }
    return {};
}

Status Context::write(const BufferView& view, const void* data, std::uint64_t bytes) {
    SPLAT_ASSERT(bytes <= view.bytes);
    SPLAT_TRY(device_->alive());
    SPLAT_TRY(queue_->settle());
    if (Profile* counted = counting()) counted->add_write(bytes);
    std::byte* host = Memory::host(view);
    if (host == nullptr) return transfer(view, nullptr, static_cast<const std::byte*>(data), bytes);
    if (bytes > 0) std::memcpy(host, data, bytes);  // data may be null
    return memory_->flush(view);
}

Status Context::read(const BufferView& view, void* data, std::uint64_t bytes) {
    SPLAT_ASSERT(bytes <= view.bytes);
    SPLAT_TRY(device_->alive());
    SPLAT_TRY(queue_->settle());
    if (Profile* counted = counting()) counted->add_read(bytes);
    std::byte* host = Memory::host(view);
    if (host == nullptr) return transfer(view, static_cast<std::byte*>(data), nullptr, bytes);
    SPLAT_TRY(memory_->invalidate(view));
    if (bytes > 0) std::memcpy(data, host, bytes);  // data may be null
    return {};
}

Status Context::fill(const BufferView& view, std::uint32_t word) {
    Recorder recorder(*this);
    SPLAT_TRY(recorder.fill(view, word));
    SPLAT_ASSIGN(CommandList list, recorder.finish());
    return run(list);
}

}  // namespace splat::vk
