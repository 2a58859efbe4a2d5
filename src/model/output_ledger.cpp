#include "model/output_ledger.h"

#include "core/checked_math.h"
#include "ops/tensor_stats.h"

namespace splat::model {

Result<OutputLedger> OutputLedger::create(vk::Context& context, const vk::BufferView& raw,
                                          const gaussians::SetDesc& desc,
                                          const gaussians::SetViews& set) {
    OutputLedger made(context);
    made.gaussians_ = set.count;
    const std::uint64_t outputs = raw.shape.elements();
    const std::uint64_t set_bytes = gaussians::set_statistics_bytes(set.count);
    const std::uint64_t raw_bytes = ops::tensor_stats_partial_bytes(outputs);
    made.raw_offset_ = round_up(set_bytes, context.device().info().limits.offset_alignment);
    SPLAT_ASSIGN(made.counts_,
                 context.memory().allocate(made.raw_offset_ + raw_bytes, vk::MemoryKind::kDevice,
                                           "counts of a model's results"));
    const vk::BufferView& all = made.counts_.range();
    vk::Recorder recorder(context);
    SPLAT_TRY(gaussians::set_statistics(recorder, desc, set, all.part(0, set_bytes)));
    SPLAT_TRY(ops::tensor_stats(recorder, outputs, raw, all.part(made.raw_offset_, raw_bytes)));
    SPLAT_ASSIGN(made.list_, recorder.finish());
    return made;
}

Ledger OutputLedger::take(std::span<const std::uint32_t> counts) {
    const ops::TensorStats raw = ops::tensor_stats_merge(counts.subspan(raw_offset_ / 4));
    Ledger ledger;
    ledger.gaussians = gaussians_;
    ledger.outputs_not_finite = raw.nan_count + raw.inf_count;
    ledger.set = gaussians::set_statistics_sum(
        counts.first(gaussians::set_statistics_bytes(gaussians_) / 4));
    const std::lock_guard lock(*mutex_);
    return latest_ = ledger;
}

}  // namespace splat::model
