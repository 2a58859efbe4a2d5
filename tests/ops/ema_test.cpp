#include "ops/ema.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "support/golden_file.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class Ema : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Ema);

std::vector<float> update(vk::Context& context, std::optional<double> decay,
                          const std::vector<float>& value, const std::vector<float>& shadow) {
    const vk::Buffer online = upload(context, value);
    const vk::Buffer average = upload(context, shadow);
    vk::Recorder recorder(context);
    const auto scalars = ops::ema_scalars(decay).value();
    const vk::Buffer rest = upload(context, std::vector<float>(scalars.begin(), scalars.end()));
    EXPECT_OK(ops::ema(recorder, rest.range(), online.range(), average.range()));
    vk::CommandList list = std::move(recorder.finish().value());
    EXPECT_OK(context.run(list));
    return download(context, average.range(), shadow.size());
}

TEST_P(Ema, MatchesFloat64) {
    for (const std::size_t elements : {4U, 8U, 1028U})
        for (const double decay : {0.5, 0.9, 0.9999, 1.0}) {
            const std::vector<float> value = normal_fill(elements, 1);
            const std::vector<float> shadow = normal_fill(elements, 2);
            const std::vector<float> gpu = update(context(), decay, value, shadow);
            for (std::size_t i = 0; i < elements; ++i) {
                const auto before = static_cast<double>(shadow[i]);
                const auto online = static_cast<double>(value[i]);
                EXPECT_NEAR(gpu[i], before - (before - online) * (1 - decay),
                            3e-7 * (std::abs(before) + std::abs(online)))  // three roundings
                    << decay << " " << i;
            }
        }
}

TEST_P(Ema, ADecayOfZeroCopiesBits) {
    const std::vector<float> value = normal_fill(64, 3);
    EXPECT_EQ(update(context(), 0, value, normal_fill(64, 4, 0, 1e6)), value);
}

TEST_P(Ema, WithoutADecayNothingChanges) {
    const std::vector<float> shadow = normal_fill(64, 4);
    EXPECT_EQ(update(context(), std::nullopt, normal_fill(64, 3), shadow), shadow);
}

ops::EmaSchedule schedule_of(const Golden& golden) {
    const std::vector<std::int64_t> cfg = golden.array("ema.cfg").ints().value();
    ops::EmaSchedule schedule;
    schedule.update_every = static_cast<std::uint64_t>(cfg.at(0));
    schedule.update_after = static_cast<std::uint64_t>(cfg.at(1));
    schedule.most = golden.doubles("ema.beta").at(0);
    return schedule;
}

TEST_P(Ema, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("train", [&](const Golden& golden) {
        const std::vector<float> series = golden.floats("ema.series");
        const std::vector<double> expected = golden.doubles("ema.out");
        const std::size_t width = golden.dim("ema.series", 1);
        const std::size_t padded = (width + 3) / 4 * 4;
        std::vector<float> shadow(padded, 0);
        for (std::size_t call = 0; call < golden.dim("ema.series", 0); ++call) {
            const auto row = series.begin() + static_cast<std::ptrdiff_t>(width * call);
            std::vector<float> value(row, row + static_cast<std::ptrdiff_t>(width));
            value.resize(padded, 0);
            const std::optional<double> decay = ops::ema_decay(call, schedule_of(golden));
            if (decay) shadow = update(context(), *decay, value, shadow);
            for (std::size_t i = 0; i < width; ++i)  // float32 on both sides, thirty updates
                ASSERT_NEAR(shadow[i], expected[width * call + i], 1e-6)
                    << golden.name << " call " << call;
        }
    });
}

TEST_P(Ema, RefusesWhatDoesNotFit) {
    const vk::Buffer block = device_buffer(context(), 8);
    const vk::Buffer other = device_buffer(context(), 4);
    vk::Recorder recorder(context());
    EXPECT_ERROR(ops::ema_scalars(1.5).status(), Code::kInvalidArgument, "decay is 1.5");
    EXPECT_ERROR(ops::ema_scalars(-0.1).status(), Code::kInvalidArgument, "decay is -0.1");
    EXPECT_ERROR(ops::ema(recorder, other.range(), block.range(), other.range()), Code::kShape,
                 "32 bytes");
    EXPECT_TRUE(recorder.finish().value().empty()) << "nothing is recorded on error";
}

/// Which calls update it, and their decay. The first one that has a decay in the file copies, too.
TEST(EmaDecay, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("train", [&](const Golden& golden) {
        const std::vector<double> expected = golden.doubles("ema.decay");
        bool first = true;
        for (std::size_t call = 0; call < expected.size(); ++call) {
            const std::optional<double> decay = ops::ema_decay(call, schedule_of(golden));
            ASSERT_EQ(decay.has_value(), expected[call] >= 0) << call;
            if (!decay) continue;
            const bool copies = expected[call] > 0 && first;
            if (copies) first = false;
            EXPECT_NEAR(*decay, copies ? 0 : expected[call], 1e-12) << call;
        }
        EXPECT_FALSE(first) << "no call has a decay";
    });
}

TEST(EmaDecay, GrowsToItsLimit) {
    EXPECT_EQ(ops::ema_decay(7), std::nullopt);
    EXPECT_EQ(ops::ema_decay(0), 0);
    EXPECT_EQ(ops::ema_decay(100), 0);
    EXPECT_LT(*ops::ema_decay(900000), 0.9999);
    EXPECT_EQ(ops::ema_decay(2000000), 0.9999);
    EXPECT_EQ(ops::ema_decay(6, {.update_every = 3, .update_after = 2, .most = 0.25, .power = 1}),
              0.25);
}

}  // namespace
}  // namespace splat::test
