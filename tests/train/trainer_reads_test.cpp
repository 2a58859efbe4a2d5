// Steps whose results are read later: the same as if they were read one by one.
#include <bit>
#include <mutex>
#include <new>

#include "support/gpu_buffers.h"
#include "support/parsed_json.h"
#include "train/trainer_fixture.h"

namespace splat::test {
namespace {

class TrainerReads : public TrainerTest {
  protected:
    TrainerReads() {
        network_.dropout = 0.1F;
        training_.ema_every = 2;
        training_.ssim_weight = 0.2;
        training_.schedule = config::Schedule::kCosine;
        training_.iterations = 40;
        training_.warmup = 3;
    }

    /// Batch i. The loss of some is infinite, though their numbers are finite.
    [[nodiscard]] Batch batch(std::uint64_t i) const {
        Batch made(network_, training_, 100 + i);
        if (i % 7 == 2 || i % 7 == 3) made.targets[5] = 1e30F;
        return made;
    }

    /// Results of `count` steps, read after every `each`.
    std::vector<TrainStep> run_all(Trainer& trainer, std::uint64_t first, std::uint64_t count,
                                   std::uint64_t each) {
        std::vector<TrainStep> steps;
        for (std::uint64_t i = 0; i < count; ++i) {
            EXPECT_OK(trainer.step(batch(first + i).view()));
            if ((i + 1) % each != 0 && i + 1 < count) continue;
            EXPECT_OK(trainer.read());
            take(trainer, steps);
        }
        return steps;
    }

    static void take(Trainer& trainer, std::vector<TrainStep>& steps) {
        steps.insert(steps.end(), trainer.results().begin(), trainer.results().end());
        trainer.results().clear();
    }

    static void expect_equal(const std::vector<TrainStep>& steps,
                             const std::vector<TrainStep>& expected) {
        ASSERT_EQ(steps.size(), expected.size());
        for (std::size_t i = 0; i < steps.size(); ++i) {
            const TrainStep &a = steps[i], &b = expected[i];
            const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
            EXPECT_EQ(bits(a.loss.total), bits(b.loss.total)) << i;
            EXPECT_EQ(bits(a.loss.squared), bits(b.loss.squared)) << i;
            EXPECT_EQ(bits(a.loss.of("ssim")), bits(b.loss.of("ssim"))) << i;
            EXPECT_EQ(a.step, b.step) << i;
            EXPECT_EQ(a.skipped, b.skipped) << i;
            EXPECT_EQ(a.pairs, b.pairs) << i;
            EXPECT_EQ(a.non_finite, b.non_finite) << i;
            EXPECT_EQ(a.gradients_zero, b.gradients_zero) << i;
            EXPECT_EQ(a.rate, b.rate) << i;
        }
    }

    static void expect_equal_states(Trainer& trainer, Trainer& other) {
        const auto expected = need(trainer.checkpoint()), got = need(other.checkpoint());
        EXPECT_EQ(expected.metadata, got.metadata);  // with a checksum of all tensors
    }

    /// An optimiser of four numbers, with `notes` bytes of notes and room for two steps.
    train::Optimiser optimiser(const vk::Buffer& value, const vk::Buffer& grad,
                               std::uint64_t notes) {
        train::OptimiserDesc desc;
        desc.parameters.push_back({"x", Shape{4}, value.range(), grad.range()});
        desc.schedule.learning_rate = 0.1;
        desc.notes.bytes = notes;
        desc.most_unread = 2;
        return need(train::Optimiser::create(context(), std::move(desc)));
    }

    model::ModelConfig network_ = small_network();
    TrainConfig training_ = small_training();
};
SPLAT_INSTANTIATE_KERNELS(TrainerReads);

TEST_P(TrainerReads, LaterAreThoseOfEachStep) {
    constexpr std::uint64_t kSteps = 20;  // more than may be unread
    const auto single = make(network_, training_);
    std::vector<TrainStep> expected;
    for (std::uint64_t i = 0; i < kSteps; ++i) expected.push_back(run(*single, batch(i)));
    EXPECT_EQ(single->steps(), 14U);
    EXPECT_TRUE(expected[2].skipped && expected[3].skipped && !expected[4].skipped);
    EXPECT_FALSE(std::isfinite(expected[2].loss.total));
    EXPECT_TRUE(single->results().empty());
    for (const std::uint64_t each : {1U, 3U, 16U, 20U}) {
        SCOPED_TRACE(each);
        const auto later = make(network_, training_);
        expect_equal(run_all(*later, 0, kSteps, each), expected);
        EXPECT_EQ(later->attempts(), kSteps);
        expect_equal_states(*single, *later);
    }
}

/// A step that is read gives its own result and keeps those of the steps before it.
TEST_P(TrainerReads, ALaterResultKeepsThoseBefore) {
    const auto single = make(network_, training_), mixed = make(network_, training_);
    std::vector<TrainStep> expected, steps;
    for (std::uint64_t i = 0; i < 4; ++i) expected.push_back(run(*single, batch(i)));
    for (std::uint64_t i = 0; i < 3; ++i) ASSERT_OK(mixed->step(batch(i).view()));
    EXPECT_EQ(mixed->unread(), 3U);
    EXPECT_EQ(mixed->attempts(), 3U);
    EXPECT_FALSE(mixed->last().has_value());
    const TrainStep last = run(*mixed, batch(3));
    EXPECT_EQ(mixed->unread(), 0U);
    EXPECT_EQ(mixed->skipped_in_a_row(), 2U);
    take(*mixed, steps);
    steps.push_back(last);
    expect_equal(steps, expected);
    run(*mixed, batch(4));
    EXPECT_EQ(mixed->skipped_in_a_row(), 0U);
}

/// A state saved while steps are unread is that of all of them, and their results are still given.
TEST_P(TrainerReads, AStateWaitsForNoRead) {
    const auto single = make(network_, training_), later = make(network_, training_);
    std::vector<TrainStep> expected, steps;
    for (std::uint64_t i = 0; i < 5; ++i) expected.push_back(run(*single, batch(i)));
    for (std::uint64_t i = 0; i < 5; ++i) ASSERT_OK(later->step(batch(i).view()));
    const auto file = need(later->checkpoint());
    EXPECT_EQ(file.metadata, need(single->checkpoint()).metadata);
    take(*later, steps);
    expect_equal(steps, expected);

    const auto resumed = make(network_, training_);
    for (std::uint64_t i = 0; i < 2; ++i) ASSERT_OK(resumed->step(batch(50 + i).view()));
    ASSERT_OK(resumed->resume(file));
    EXPECT_EQ(resumed->results().size(), 2U) << "of steps that are gone";
    resumed->results().clear();
    EXPECT_EQ(resumed->attempts(), 5U);
    expected.clear();
    for (std::uint64_t i = 5; i < 12; ++i) expected.push_back(run(*single, batch(i)));
    expect_equal(run_all(*resumed, 5, 7, 4), expected);
    expect_equal_states(*single, *resumed);
}

/// The host reads the rasterizer's statistics alone of a step without a result.
TEST_P(TrainerReads, AStepReadsNothingElse) {
    vk::ContextDesc desc = context_desc(GetParam());
    desc.profile = true;
    const auto device = make_context(desc);
    const auto trainer = need(Trainer::create(*device, network_, training_));
    ASSERT_OK(trainer->model().init(7));
    const auto read_by = [&](const auto& call) {
        device->profile()->reset();
        EXPECT_OK(call());
        const Json profile = need(parse_json(device->profile()->json("x"), "profile"));
        return profile["transfers"]["read_bytes"].get<std::uint64_t>();
    };
    const Batch first = batch(0);
    ASSERT_OK(trainer->step(first.view()));
    const std::uint64_t without = read_by([&] { return trainer->step(first.view()); });
    EXPECT_LE(without, 128U * training_.batch_size);
    EXPECT_GT(read_by([&] { return trainer->read(); }), 2 * 1024U) << "losses of two steps";
    EXPECT_EQ(read_by([&] { return trainer->read(); }), 0U);
    EXPECT_EQ(read_by([&] { return trainer->step(first.view()); }), without);
}

/// A call may be cancelled between the update and the read that staging memory has no room for.
TEST_P(TrainerReads, AnUpdateThatRanCounts) {
    constexpr std::uint64_t kNotes = 1U << 20;
    const std::vector<float> most((7U << 20) / sizeof(float));
    const auto value = upload(context(), std::vector<float>(4, 1));
    const auto grad = upload(context(), std::vector<float>(4, 1));
    const auto large = device_buffer(context(), most.size());
    auto made = optimiser(value, grad, kNotes);
    std::size_t steps = 0;
    {
        const std::lock_guard call(context().mutex);
        vk::Batch batch;
        vk::BatchScope scope(context(), batch);
        ASSERT_OK(context().fill(large.range(), 1));
        ASSERT_OK(context().write(large.range(), most.data(), large.bytes()));
        ASSERT_OK(context().read_later(grad.range(), 4,
                                       [&](auto) { context().mutex.interrupt().raise(); }));
        EXPECT_FALSE(context().stages(kNotes));
        ASSERT_OK(made.step(0, [&](const auto& all) { steps = all.size(); }));
        EXPECT_ERROR(context().read(value.range(), &steps, 4), Code::kCancelled, "cancelled");
    }
    EXPECT_EQ(steps, 1U);
    EXPECT_EQ(made.steps(), 1U);
    EXPECT_EQ(made.unread(), 0U);
    const std::lock_guard call(context().mutex);
    EXPECT_LT(download(context(), value.range(), 4)[0], 1);
}

TEST_P(TrainerReads, ResultsThatMemoryDoesNotHoldAreReadAgain) {
    const auto value = upload(context(), std::vector<float>(4, 1));
    const auto grad = upload(context(), std::vector<float>(4, 1));
    auto made = optimiser(value, grad, 0);
    const auto fails = [](const auto&) { throw std::bad_alloc(); };
    ASSERT_OK(made.step());
    EXPECT_THROW((void)made.step(0, fails), std::bad_alloc);
    EXPECT_THROW((void)made.read(fails), std::bad_alloc);
    EXPECT_EQ(made.unread(), 2U) << "the second update ran";
    EXPECT_EQ(made.steps(), 0U);
    std::vector<std::uint64_t> steps;
    ASSERT_OK(made.read([&](const auto& all) {
        for (const train::OptimiserRead& each : all) steps.push_back(each.step.step);
    }));
    EXPECT_EQ(steps, (std::vector<std::uint64_t>{1, 2}));
    EXPECT_EQ(made.steps(), 2U);
    EXPECT_EQ(made.unread(), 0U);
}

int g_pools = 0;
PFN_vkCreateDescriptorPool g_make_pool = nullptr;

/// Each pass is a list of its own, as its notes have their own place.
TEST_P(TrainerReads, ManyPassesAreJoinedOnce) {
    if (GetParam() != vk::Kernels::kCpu) GTEST_SKIP() << "the same for all kernels";
    network_.channel_mult = {1};
    network_.attention_resolutions.clear();
    training_.batch_size = 40;
    training_.micro_batch = 1;
    training_.targets = 1;
    const auto trainer = make(network_, training_);
    const Batch first = batch(0);
    run(*trainer, first);
    auto& pool = context().device().vk.vkCreateDescriptorPool;
    g_pools = 0;
    g_make_pool = pool;
    pool = [](VkDevice device, const VkDescriptorPoolCreateInfo* info,
              const VkAllocationCallbacks* callbacks, VkDescriptorPool* made) {
        ++g_pools;
        return g_make_pool(device, info, callbacks, made);
    };
    run(*trainer, first);
    pool = g_make_pool;
    EXPECT_EQ(g_pools, 0);
}

}  // namespace
}  // namespace splat::test
