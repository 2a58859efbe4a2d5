// ops::step_decision against the same rules on the host.
#include <gtest/gtest.h>

#include <bit>

#include "ops/adam.h"
#include "ops/op_harness.h"
#include "ops/tensor_stats.h"
#include "support/gpu_buffers.h"

namespace splat::test::decision {
namespace {

constexpr std::uint32_t kRows = 4, kRules = 2, kEntry = 4 * (2 * kRules + 1);
constexpr std::uint32_t kObjects = 3, kBlock = 12, kUnchecked = 4;  // floats
constexpr std::uint32_t kNotes = kObjects * kBlock + 4;             // the last quad is not checked
constexpr std::uint32_t kEmaAt = 24;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// What one step measured.
struct Measured {
    std::vector<std::vector<float>> gradients;
    std::vector<float> notes = normal_fill(kNotes, 5);
    float loss = 0;

    [[nodiscard]] std::uint32_t not_finite() const {
        std::uint32_t count = 0;
        for (const std::vector<float>& run : gradients)
            for (const float g : run) count += std::isfinite(g) ? 0 : 1;
        return count;
    }
    [[nodiscard]] bool zero() const {
        for (const std::vector<float>& run : gradients)
            for (const float g : run)
                if (g != 0) return false;
        return true;
    }
    [[nodiscard]] bool skipped() const {
        bool bad = not_finite() > 0 || !std::isfinite(loss);
        for (std::uint32_t i = 0; i < kObjects * kBlock; ++i)
            bad = bad || (i % kBlock >= kUnchecked && !std::isfinite(notes[i]));
        return bad;
    }
};

class StepDecision : public KernelsTest {
  protected:
    /// Steps in which one thing after another is wrong, of `sizes` gradients.
    static std::vector<Measured> steps_of(const std::vector<std::size_t>& sizes) {
        Measured good;
        for (const std::size_t size : sizes) good.gradients.push_back(normal_fill(size, size));
        std::vector<Measured> steps(12, good);
        steps[1].gradients.back().back() = kNan;
        steps[2].gradients.front()[sizes.front() / 2] = -kInfinity;
        steps[2].gradients.back().front() = kNan;
        steps[4].notes[kUnchecked] = kNan;
        steps[5].notes[2 * kBlock + kBlock - 1] = kInfinity;
        steps[6].notes[kBlock] = kNan;           // not part of the loss
        steps[7].notes[kNotes - 1] = kInfinity;  // behind the losses
        steps[8].loss = kInfinity;
        for (std::vector<float>& run : steps[9].gradients) std::ranges::fill(run, 0.0F);
        for (std::vector<float>& run : steps[10].gradients) std::ranges::fill(run, -0.0F);
        steps[10].gradients.back().back() = 1e-30F;
        return steps;
    }

    void expect_decisions(const std::vector<std::size_t>& sizes) {
        constexpr std::uint64_t kPart = 256;
        std::vector<vk::Buffer> gradients;
        for (const std::size_t size : sizes)
            gradients.push_back(device_buffer(context(), (size + 3) / 4 * 4));
        const vk::Buffer notes = device_buffer(context(), kNotes);
        const vk::Buffer inputs = device_buffer(context(), 4 + kRows * kEntry);
        const vk::Buffer history = device_buffer(context(), kRows * (4 + kNotes));
        const vk::Buffer scalars = device_buffer(context(), kEmaAt + 4);
        const vk::Buffer partial =
            upload(context(), std::vector<std::uint32_t>(sizes.size() * kPart / 4, 0));
        vk::Recorder recorder(context());
        for (std::size_t i = 0; i < sizes.size(); ++i)
            ASSERT_OK(ops::tensor_stats(recorder, sizes[i], gradients[i].range(),
                                        partial.range().part(i * kPart, kPart)));
        ops::StepDecision decision;
        decision.partial = partial.range();
        decision.notes = notes.range();
        decision.checked = kObjects * kBlock * sizeof(float);
        decision.block = kBlock * sizeof(float);
        decision.unchecked = kUnchecked * sizeof(float);
        decision.inputs = inputs.range();
        decision.rules = kRules;
        decision.history = history.range();
        decision.scalars = scalars.range();
        decision.ema_at = kEmaAt * sizeof(float);
        ASSERT_OK(ops::step_decision(recorder, decision));
        vk::CommandList list = std::move(recorder.finish().value());

        std::vector<float> given = normal_fill(4 + kRows * kEntry, 9);
        std::uint32_t row = 0, updates = 0;
        for (const Measured& step : steps_of(sizes)) {
            SCOPED_TRACE(row);
            if (row % kRows == 0) updates = 0;
            given[0] = std::bit_cast<float>(row % kRows);
            given[1] = step.loss;
            const auto write = [&](const vk::Buffer& to, const std::vector<float>& values) {
                ASSERT_OK(context().write(to.range(), values.data(), 4 * values.size()));
            };
            write(inputs, given);
            write(notes, step.notes);
            for (std::size_t i = 0; i < sizes.size(); ++i) write(gradients[i], step.gradients[i]);
            ASSERT_OK(context().run(list));

            std::vector<float> entry(given.begin() + 4 + updates * kEntry,
                                     given.begin() + 4 + (updates + 1) * kEntry);
            if (step.skipped()) entry[7] = entry[15] = entry[19] = 1;
            updates += step.skipped() ? 0 : 1;
            std::vector<float> got = download(context(), scalars.range(), kEmaAt + 4);
            got.erase(got.begin() + 16, got.begin() + kEmaAt);
            EXPECT_EQ(got, entry);
            const vk::BufferView made =
                history.range().part(row % kRows * 4 * (4 + kNotes), 4 * (4 + kNotes));
            EXPECT_EQ(download_words(context(), made, 4),
                      (std::vector<std::uint32_t>{step.skipped() ? 1U : 0U, updates,
                                                  step.not_finite(), step.zero() ? 1U : 0U}));
            std::vector<std::uint32_t> kept = download_words(context(), made, 4 + kNotes);
            for (std::size_t i = 0; i < kNotes; ++i)
                EXPECT_EQ(kept[4 + i], std::bit_cast<std::uint32_t>(step.notes[i])) << i;
            ++row;
        }
    }
};
SPLAT_INSTANTIATE_KERNELS(StepDecision);

TEST_P(StepDecision, IsThatOfTheHost) {
    expect_decisions({5});
    expect_decisions({1, 40000, 3});  // chunks of 16384
    expect_decisions({7, 2, 20000, 1, 4});
}

}  // namespace
}  // namespace splat::test::decision
