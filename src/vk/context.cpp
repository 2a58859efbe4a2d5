#include "vk/context.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>
#include <vector>

#include "core/checked_math.h"
#include "core/environment.h"
#include "core/fork.h"
#include "core/stopwatch.h"
#include "vk/watchdog.h"

namespace splat::vk {
namespace {

constexpr double kDefaultTimeoutNs = 60e9;
/// Piece of a staged transfer: large enough to hide the submit, small enough to keep the staging
/// block small.
constexpr std::uint64_t kStagingBytes = std::uint64_t{8} << 20;
constexpr std::uint64_t kLeastStagingBytes = std::uint64_t{64} << 10;
/// Between parts of it: more than the largest atom of memory that is not coherent.
constexpr std::uint64_t kStagingAlignment = 256;

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
    if (desc.device.adopted) context->desc_.device.adopted->features = nullptr;
    context->desc_.device.select = DeviceSelect::kByIndex;
    context->desc_.device.index = device.info().index;
    context->timeout_ns_ = timeout_ns;
    context->profile_enabled_ = desc.profile;
    context->profile_levels_ = desc.profile_levels;
    return context;
}

Status Context::reopen() {
    SPLAT_ASSERT(!device_->adopted());
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
    drop({});
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

void Context::note(Noted noted) {
    dropped_.reserve(dropped_.size() + 1);
    noted_.push_back(std::move(noted));
    memory_->defer_frees(Memory::Deferral::kNoted, true);
}

bool Context::stages(std::uint64_t bytes) const {
    return staged_ + bytes <= kStagingBytes;
}

Result<BufferView> Context::stage(std::uint64_t bytes) {
    SPLAT_ASSERT(bytes <= kStagingBytes);
    if (!stages(bytes)) SPLAT_TRY(flush());
    if (staged_ == 0) SPLAT_TRY(reserve_staging(kStagingBytes));
    const BufferView stage = staging_->range().part(staged_, bytes);
    staged_ += round_up(bytes, kStagingAlignment);
    return stage;
}

void Context::drop(std::vector<Noted> work) noexcept {
    later_.clear();
    const std::size_t all = work.size();
    std::erase_if(work, [](const Noted& noted) { return !noted.staged; });
    if (work.size() < all) dropped_.push_back(number_);  // note() has reserved it
    ++number_;
    noted_ = std::move(work);
    if (noted_.empty()) nothing_noted();
}

void Context::nothing_noted() noexcept {
    staged_ = 0;
    memory_->defer_frees(Memory::Deferral::kNoted, false);
}

Status Context::flush() {
    if (noted_.empty()) return {};
    std::vector<Noted> work = std::move(noted_);
    noted_.clear();
    std::vector<Later> later = std::move(later_);
    later_.clear();
    const auto run_all = [&]() -> Status {
        Batch alone;  // for writes that a batch before still owes
        SPLAT_ASSIGN(CommandList * list, (batch_ != nullptr ? *batch_ : alone).join(*this, work));
        return run_now(*list);
    };
    const Stopwatch watch;
    if (const Status done = run_all(); !done.ok()) {
        drop(std::move(work));
        return done;
    }
    const double seconds = watch.seconds();
    double all = 0;
    for (const Noted& each : work) all += each.estimated_seconds();
    for (const Noted& each : work)
        if (each.seconds != nullptr && all > 0)
            *each.seconds += seconds * each.estimated_seconds() / all;
    ++number_;
    nothing_noted();
    for (const Later& each : later) {
        SPLAT_TRY(memory_->invalidate(each.stage));
        each.use({Memory::host(each.stage), each.stage.bytes});
    }
    return {};
}

Result<std::uint64_t> Context::submit_frame(const BufferView& pixels, const FrameTarget& target) {
    SPLAT_ASSERT(batch_ != nullptr && !noted_.empty() && later_.empty());
    std::vector<Noted> work = std::move(noted_);
    noted_.clear();
    const auto submit = [&]() -> Result<std::uint64_t> {
        SPLAT_ASSIGN(CommandList * list, batch_->join(*this, work));
        return queue_->submit_frame(*list, pixels, target);
    };
    Result<std::uint64_t> value = submit();
    if (!value.ok()) {
        drop(std::move(work));
        return value;
    }
    ++number_;
    nothing_noted();
    return value;
}

Status Context::run(CommandList& list) {
    if (batch_ != nullptr) {
        SPLAT_TRY(device_->alive());
        if (!list.empty()) note({.list = list, .seconds = charge, .whole = mutex.uncancelled()});
        return {};
    }
    SPLAT_TRY(flush());
    return run_now(list);
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
        SPLAT_TRY(run_now(list));
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
    if (batch_ == nullptr || bytes > kStagingBytes) SPLAT_TRY(flush());
    if (Profile* counted = counting()) counted->add_write(bytes);
    std::byte* host = Memory::host(view);
    const bool waits =
        std::ranges::any_of(noted_, [&](const Noted& noted) { return noted.touches(view); });
    if (bytes > 0 && bytes <= kStagingBytes && batch_ != nullptr && (host == nullptr || waits)) {
        SPLAT_ASSIGN(const BufferView staged, stage(bytes));
        std::memcpy(Memory::host(staged), data, bytes);
        SPLAT_TRY(memory_->flush(staged));
        note({.kind = CommandKind::kCopy,
              .from = staged,
              .to = view.part(0, bytes),
              .staged = true});
        return {};
    }
    if (host == nullptr) return transfer(view, nullptr, static_cast<const std::byte*>(data), bytes);
    if (bytes > 0) std::memcpy(host, data, bytes);  // data may be null
    return memory_->flush(view);
}

Status Context::read(const BufferView& view, void* data, std::uint64_t bytes) {
    SPLAT_ASSERT(bytes <= view.bytes);
    SPLAT_TRY(device_->alive());
    SPLAT_TRY(queue_->settle());
    std::byte* host = Memory::host(view);
    if (batch_ != nullptr && host == nullptr && bytes > 0 && bytes <= kStagingBytes) {
        SPLAT_TRY(read_later(view, bytes, [data](std::span<const std::byte> found) {
            std::memcpy(data, found.data(), found.size());
        }));
        return flush();
    }
    SPLAT_TRY(flush());
    if (Profile* counted = counting()) counted->add_read(bytes);
    if (host == nullptr) return transfer(view, static_cast<std::byte*>(data), nullptr, bytes);
    SPLAT_TRY(memory_->invalidate(view));
    if (bytes > 0) std::memcpy(data, host, bytes);  // data may be null
    return {};
}

Status Context::read_later(const BufferView& view, std::uint64_t bytes, Use use) {
    if (batch_ == nullptr || bytes > kStagingBytes) {
        std::vector<std::byte> data(bytes);
        SPLAT_TRY(read(view, data.data(), bytes));
        use(data);
        return {};
    }
    SPLAT_ASSERT(bytes <= view.bytes);
    if (Profile* counted = counting()) counted->add_read(bytes);
    SPLAT_ASSIGN(const BufferView staged, stage(bytes));
    note({.kind = CommandKind::kCopy, .from = view.part(0, bytes), .to = staged});
    later_.push_back({staged, std::move(use)});
    return {};
}

Status Context::fill(const BufferView& view, std::uint32_t word) {
    if (batch_ != nullptr) {
        note({.kind = CommandKind::kFill, .to = view, .word = word});
        return {};
    }
    Recorder recorder(*this);
    SPLAT_TRY(recorder.fill(view, word));
    SPLAT_ASSIGN(CommandList list, recorder.finish());
    return run(list);
}

}  // namespace splat::vk
