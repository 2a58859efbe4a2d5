// What ranks tell each other in a step besides gradients.

#include <cstring>

#include "core/stopwatch.h"
#include "train/trainer.h"

namespace splat::train {

Status Trainer::share(Outliers& outliers) {
    if (group_ == nullptr) return {};
    const std::span mine =
        std::span(outliers).subspan(first_pass(), objects_ / config_.micro_batch);
    return group_->gather(std::as_bytes(mine), std::as_writable_bytes(std::span(outliers)));
}

Status Trainer::read_notes(std::span<std::byte> losses, std::span<std::byte> counts) {
    const vk::BufferView& notes = optimiser_->notes();
    const std::uint64_t first_loss = first_object() * losses_bytes();
    const std::uint64_t first_count =
        config_.batch_size * losses_bytes() + first_pass() * counts_bytes();
    SPLAT_TRY(context_.read(notes.part(first_loss, losses.size()), losses.data(), losses.size()));
    return context_.read(notes.part(first_count, counts.size()), counts.data(), counts.size());
}

Result<std::vector<std::byte>> Trainer::share_notes(TrainStep& step) {
    if (group_ == nullptr) return std::vector<std::byte>();
    struct Head {
        std::int32_t failed = 0;
        std::uint64_t pairs = 0, visible = 0, culled = 0;
    };
    const std::uint64_t losses = objects_ * losses_bytes();
    const std::uint64_t counts = objects_ / config_.micro_batch * counts_bytes();
    std::vector<std::byte> mine(sizeof(Head) + losses + counts);
    const std::span<std::byte> notes = std::span(mine).subspan(sizeof(Head));
    const Status read = read_notes(notes.first(losses), notes.subspan(losses));
    const Stopwatch watch;
    Head head{read.ok() ? 0 : 1, step.pairs, step.visible, step.culled};
    std::memcpy(mine.data(), &head, sizeof head);
    std::vector<std::byte> of_all(mine.size() * group_->count()), all(optimiser_->notes().bytes);
    SPLAT_TRY(group_->gather(mine, of_all));
    step.exchange_seconds += watch.seconds();
    step.pairs = step.visible = step.culled = 0;
    bool failed = false;
    for (std::uint32_t rank = 0; rank < group_->count(); ++rank) {
        const std::byte* const from = &of_all[rank * mine.size()];
        std::memcpy(&head, from, sizeof head);
        failed = failed || head.failed != 0;
        step.pairs += head.pairs;
        step.visible += head.visible;
        step.culled += head.culled;
        std::memcpy(&all[rank * losses], from + sizeof head, losses);
        std::memcpy(&all[group_->count() * losses + rank * counts], from + sizeof head + losses,
                    counts);
    }
    if (failed) return group_->agree(read);
    return all;
}

}  // namespace splat::train
