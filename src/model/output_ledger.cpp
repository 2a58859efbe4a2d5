#include "model/output_ledger.h"

#include <cstring>

#include "core/checked_math.h"
#include "ops/tensor_stats.h"

namespace splat::model {

Result<OutputLedger> OutputLedger::create(vk::Context& context,
                                          const std::array<vk::BufferView, 6>& results,
                                          const vk::BufferView& opacities) {
    OutputLedger made(context);
    const std::uint64_t alignment = context.device().info().limits.offset_alignment;
    std::uint64_t end = 0;
    const auto place = [&](std::uint64_t bytes) {
        const std::uint64_t offset = round_up(end, alignment);
        end = offset + round_up(bytes, 16);
        return offset;
    };
    for (std::size_t i = 0; i < results.size(); ++i) {
        made.bytes_[i] = ops::tensor_stats_partial_bytes(results[i].shape.elements());
        made.offsets_[i] = place(made.bytes_[i]);
    }
    made.opacities_ = opacities.shape.elements();
    made.opacities_offset_ = place(made.opacities_ * sizeof(float));
    SPLAT_ASSIGN(made.counts_, context.memory().allocate(end, vk::MemoryKind::kDevice,
                                                         "counts of a model's results"));
    vk::Recorder recorder(context);
    const vk::BufferView& all = made.counts_.range();
    for (std::size_t i = 0; i < results.size(); ++i)
        SPLAT_TRY(ops::tensor_stats(recorder, results[i].shape.elements(), results[i],
                                    all.part(made.offsets_[i], round_up(made.bytes_[i], 16))));
    const std::uint64_t copied = made.opacities_ * sizeof(float);
    SPLAT_TRY(recorder.copy(opacities.part(0, copied), all.part(made.opacities_offset_, copied)));
    SPLAT_ASSIGN(made.list_, recorder.finish());
    return made;
}

Status OutputLedger::measure(Ledger& ledger) {
    SPLAT_TRY(context_->run(list_));
    std::vector<std::byte> all(counts_.bytes());
    SPLAT_TRY(context_->read(counts_.range(), all.data(), all.size()));
    ledger = {};
    std::vector<std::uint32_t> words;
    for (std::size_t i = 0; i < offsets_.size(); ++i) {
        words.resize(bytes_[i] / 4);
        std::memcpy(words.data(), all.data() + offsets_[i], bytes_[i]);
        const ops::TensorStats stats = ops::tensor_stats_merge(words);
        ledger.non_finite += stats.nan_count + stats.inf_count;
    }
    std::vector<float> opacities(opacities_);
    std::memcpy(opacities.data(), all.data() + opacities_offset_, opacities_ * sizeof(float));
    ledger.gaussians = opacities_;
    for (const float opacity : opacities) ledger.faint += opacity < 1.0F / 255 ? 1 : 0;
    return {};
}

}  // namespace splat::model
