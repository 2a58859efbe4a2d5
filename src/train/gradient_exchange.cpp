#include "train/gradient_exchange.h"

#include <algorithm>
#include <bit>

#include "core/checked_math.h"
#include "core/stopwatch.h"
#include "ops/add.h"

namespace splat::train {
namespace {

/// Most bytes of a piece: as many as transfers stage at once.
constexpr std::uint64_t kPieceBytes = std::uint64_t{8} << 20;
/// Pieces on their way. Each takes up to 12 MiB of host memory.
constexpr std::size_t kMostMoving = 16;
/// A piece has at least this share of all gradients, as each costs messages.
constexpr std::uint64_t kMostSmallPieces = 16;
/// The largest offset alignment that Vulkan allows a device.
constexpr std::uint64_t kShareAlignment = 256;

}  // namespace

Result<std::unique_ptr<GradientExchange>> GradientExchange::create(vk::Context& context,
                                                                   run::Group& group,
                                                                   const nn::Parameters& parameters,
                                                                   const nn::BackwardParts& parts,
                                                                   const Memory& memory) {
    std::unique_ptr<GradientExchange> made(new GradientExchange(context, group, parts.count));
    for (const vk::BufferView& block : memory.gradients) made->cut(parameters, parts, block);
    SPLAT_TRY(made->record(memory));
    std::ranges::stable_sort(made->pieces_, {}, &Piece::final_in);
    return made;
}

/// Cut a block into pieces, where gradients become final in another part.
void GradientExchange::cut(const nn::Parameters& parameters, const nn::BackwardParts& parts,
                           const vk::BufferView& block) {
    std::uint64_t all = 0;
    for (const nn::ParameterBlock& each : parameters.blocks()) all += each.grads.bytes;
    const std::uint64_t least = std::min(kPieceBytes, all / kMostSmallPieces);
    std::vector<Piece> runs;
    for (std::size_t i = 0; i < parameters.all().size(); ++i) {
        const vk::BufferView& gradient = parameters.all()[i].grad;
        if (!gradient.overlaps(block)) continue;
        const std::uint32_t part = parts.final_in.empty() ? parts.count - 1 : parts.final_in[i];
        if (runs.empty() || (runs.back().final_in != part && runs.back().view.bytes >= least))
            runs.push_back({block.part(gradient.offset - block.offset, 0), part});
        Piece& run = runs.back();
        run.view.bytes = gradient.end() - run.view.offset;
        run.final_in = std::max(run.final_in, part);
    }
    for (std::size_t i = 0; i < runs.size(); ++i) {
        // With the padding behind it.
        const std::uint64_t end = i + 1 < runs.size() ? runs[i + 1].view.offset : block.end();
        const vk::BufferView run =
            block.part(runs[i].view.offset - block.offset, end - runs[i].view.offset);
        for (std::uint64_t at = 0; at < run.bytes; at += kPieceBytes)
            pieces_.push_back(
                {run.part(at, std::min(kPieceBytes, run.bytes - at)), runs[i].final_in});
    }
}

Status GradientExchange::record(const Memory& memory) {
    std::uint64_t most = 0;
    for (const Piece& piece : pieces_)
        most = std::max(most, share_bytes(piece.view.bytes) * group_.count());
    if (group_.reproducible())
        SPLAT_SET(received_, context_.memory().allocate(most / 2, vk::MemoryKind::kDevice,
                                                        "gradients of another rank"));
    slots_.resize(std::min(kMostMoving, pieces_.size()));
    for (Slot& slot : slots_) {
        slot.host.resize(most);
        if (group_.reproducible()) slot.from_partner.resize(most / 2);
    }
    for (Piece& piece : pieces_) SPLAT_TRY(record(piece, memory));
    return {};
}

Status GradientExchange::record(Piece& piece, const Memory& memory) {
    const auto add = [&](vk::Recorder& recorder, const vk::BufferView& a,
                         const vk::BufferView& sum) {
        const ops::AddDesc desc{{.n = static_cast<std::uint32_t>(sum.bytes / 16), .c = 4}};
        return ops::add_forward(recorder, desc, a, sum, sum);
    };
    vk::Recorder merge(context_);
    for (const std::vector<vk::BufferView>& addend : memory.addends)
        for (std::size_t block = 0; block < addend.size(); ++block) {
            const vk::BufferView& all = memory.gradients[block];
            if (!all.overlaps(piece.view)) continue;
            SPLAT_TRY(add(merge,
                          addend[block].part(piece.view.offset - all.offset, piece.view.bytes),
                          piece.view));
        }
    SPLAT_SET(piece.merge, merge.finish());
    for (std::uint32_t level = 0; group_.reproducible() && level < levels(); ++level) {
        const vk::BufferView sum = view_of(piece, kept(level + 1, group_.rank()));
        piece.adds.emplace_back();
        if (sum.bytes == 0) continue;
        vk::Recorder recorder(context_);
        SPLAT_TRY(add(recorder, received_.range().part(0, sum.bytes), sum));
        SPLAT_SET(piece.adds.back(), recorder.finish());
    }
    return {};
}

std::uint32_t GradientExchange::levels() const {
    return static_cast<std::uint32_t>(std::countr_zero(group_.count()));
}

std::uint64_t GradientExchange::share_bytes(std::uint64_t piece) const {
    return round_up(ceil_div(piece, group_.count()), kShareAlignment);
}

vk::BufferView GradientExchange::view_of(const Piece& piece, const Shares& shares) const {
    const std::uint64_t each = share_bytes(piece.view.bytes);
    const std::uint64_t first = std::min(shares.first * each, piece.view.bytes);
    return piece.view.part(first, std::min(shares.end * each, piece.view.bytes) - first);
}

GradientExchange::Shares GradientExchange::kept(std::uint32_t levels, std::uint32_t rank) const {
    Shares shares{0, group_.count()};
    for (std::uint32_t level = 0; level < levels; ++level) {
        const std::uint64_t half = (shares.first + shares.end) / 2;
        ((rank >> level & 1U) == 0 ? shares.end : shares.first) = half;
    }
    return shares;
}

std::size_t GradientExchange::lists() const {
    return (calls() + 2) * pieces_.size() + parts_;
}

void GradientExchange::begin(ExchangeThread& thread) {
    thread_ = &thread;
    moving_.clear();
    free_.resize(slots_.size());
    for (std::size_t i = 0; i < free_.size(); ++i) free_[i] = i;
    started_ = 0;
    next_ = 0;
    ended_ = {};
    device_ = {};
}

Status GradientExchange::sum(const Pass& pass, double& seconds) {
    ExchangeThread thread;  // waits for its calls, however this ends
    begin(thread);
    const Status here = pass([&](std::uint32_t part) -> Status {
        SPLAT_TRY(after(part, {}, seconds));
        return device_;
    });
    while (next_ < parts_) SPLAT_TRY(after(next_, here, seconds));
    context_.charge = nullptr;
    const Stopwatch watch;
    if (device_.ok()) device_ = context_.flush();
    ended_ = group_.agree(device_);
    seconds += watch.seconds();
    return ended_;
}

/// Errors: those of the group. `here`: what became of the parts up to this one.
Status GradientExchange::after(std::uint32_t part, Status here, double& seconds) {
    SPLAT_TRY(ended_);
    double* const charge = context_.charge;
    if (here.ok() && device_.ok()) here = context_.flush();
    context_.charge = nullptr;
    const Stopwatch watch;
    if (device_.ok()) device_ = std::move(here);
    next_ = part + 1;
    if (part == 0) {
        if (device_.ok()) device_ = thread_->start();
        ended_ = group_.agree(device_);
    }
    if (ended_.ok()) ended_ = move_pieces(part);
    seconds += watch.seconds();
    context_.charge = charge;
    return ended_;
}

/// Each piece that is on its way by a call, then those that are final now; after the last part all to their end.
Status GradientExchange::move_pieces(std::uint32_t part) {
    for (std::size_t left = moving_.size(); left-- > 0;) SPLAT_TRY(move_first());
    start_pieces(part);
    while (part + 1 == parts_ && !moving_.empty()) {
        SPLAT_TRY(move_first());
        start_pieces(part);
    }
    return {};
}

Status GradientExchange::move_first() {
    Moving moving = moving_.front();
    SPLAT_TRY(thread_->wait(moving.call));
    moving_.pop_front();
    take(moving);
    if (++moving.done == calls()) {
        free_.push_back(moving.slot);
        return {};
    }
    post(moving);
    moving_.push_back(moving);
    return {};
}

void GradientExchange::start_pieces(std::uint32_t part) {
    for (; started_ < pieces_.size() && pieces_[started_].final_in <= part && !free_.empty();
         ++started_) {
        Moving moving{started_, free_.back()};
        free_.pop_back();
        run(pieces_[started_].merge);
        post(moving);
        moving_.push_back(moving);
    }
}

/// Read what the next call of a piece sends, and post the call.
void GradientExchange::post(Moving& moving) {
    const std::uint32_t rank = group_.rank(), top = levels();
    run::Group* const group = &group_;
    if (!group_.reproducible()) {
        const std::span<std::byte> host = host_of(moving, {0, group_.count()});
        read(moving, {0, group_.count()});
        const std::span numbers(reinterpret_cast<float*>(host.data()),
                                pieces_[moving.piece].view.bytes / sizeof(float));
        moving.call = thread_->post([group, numbers] { return group->sum(numbers); });
        return;
    }
    const bool up = moving.done < top;
    const std::uint32_t level = up ? moving.done : 2 * top - 1 - moving.done;
    const std::uint32_t partner = partner_of(level);
    const Shares theirs = kept(level + 1, partner), mine = kept(level + 1, rank);
    if (up) read(moving, theirs);
    if (moving.done == top) read(moving, mine);
    const std::span<std::byte> sent = host_of(moving, up ? theirs : mine);
    const std::span<std::byte> got =
        up ? std::span(slots_[moving.slot].from_partner).first(sent.size())
           : host_of(moving, theirs);
    moving.call =
        thread_->post([group, partner, sent, got] { return group->exchange(partner, sent, got); });
}

/// Give the device what a call got.
void GradientExchange::take(const Moving& moving) {
    Piece& piece = pieces_[moving.piece];
    const std::uint32_t top = levels();
    if (!group_.reproducible()) return write(piece.view, slots_[moving.slot].host);
    if (moving.done < top) {
        const std::uint64_t bytes = view_of(piece, kept(moving.done + 1, group_.rank())).bytes;
        write(received_.range().part(0, bytes), slots_[moving.slot].from_partner);
        return run(piece.adds[moving.done]);
    }
    const std::uint32_t level = 2 * top - 1 - moving.done;
    const Shares theirs = kept(level + 1, partner_of(level));
    write(view_of(piece, theirs), host_of(moving, theirs));
}

std::span<std::byte> GradientExchange::host_of(const Moving& moving, const Shares& shares) {
    const std::uint64_t each = share_bytes(pieces_[moving.piece].view.bytes);
    return std::span(slots_[moving.slot].host)
        .subspan(shares.first * each, (shares.end - shares.first) * each);
}

void GradientExchange::read(const Moving& moving, const Shares& shares) {
    const vk::BufferView view = view_of(pieces_[moving.piece], shares);
    if (device_.ok() && view.bytes > 0)
        device_ = context_.read(view, host_of(moving, shares).data(), view.bytes);
}

void GradientExchange::write(const vk::BufferView& view, std::span<const std::byte> bytes) {
    if (device_.ok() && view.bytes > 0) device_ = context_.write(view, bytes.data(), view.bytes);
}

void GradientExchange::run(vk::CommandList& list) {
    if (device_.ok() && !list.empty()) device_ = context_.run(list);
}

}  // namespace splat::train
