// Ranks that train together: the same bits as one rank, and errors of any on all.
#include <bit>
#include <filesystem>

#include "model/lpips_weights.h"
#include "train/rank_contexts.h"
#include "train/trainer_fixture.h"

namespace splat::test {
namespace {

/// What a rank knows after some steps.
struct Trained {
    std::vector<TrainStep> steps;
    io::WeightsFile state;
    io::NamedTensors average;
};

class TrainerGroup : public RankContexts {
  protected:
    TrainerGroup() {
        network_.dropout = 0.1F;
        training_.batch_size = 4;
        training_.ssim_weight = 0.2;
        training_.schedule = config::Schedule::kCosine;
        training_.iterations = 40;
        training_.warmup = 3;
    }

    /// A rank's part of a batch.
    [[nodiscard]] TrainBatch part(const Batch& batch, std::uint32_t rank,
                                  std::uint32_t ranks) const {
        const auto of = [&](auto all) {
            const std::size_t each = all.size() / ranks;
            return all.subspan(rank * each, each);
        };
        TrainBatch mine = batch.view();
        mine.images = of(mine.images);
        mine.view_to_world = of(mine.view_to_world);
        mine.quaternions = of(mine.quaternions);
        mine.focals = of(mine.focals);
        mine.planes = of(mine.planes);
        mine.targets = of(mine.targets);
        mine.cameras = of(mine.cameras);
        return mine;
    }

    std::unique_ptr<Trainer> make(vk::Context& context, run::Group* group) const {
        auto made = need(Trainer::create(context, network_, training_, group));
        EXPECT_OK(made->model().init(7));
        return made;
    }

    /// Steps with batches first ... end - 1, from `state` if there is one.
    std::vector<Trained> train(std::uint32_t ranks, std::uint64_t first, std::uint64_t end,
                               const io::WeightsFile* state = nullptr) const {
        std::vector<Trained> all(ranks);
        on_ranks(ranks, [&](vk::Context& context, run::Group* group, std::uint32_t rank) {
            const auto trainer = make(context, group);
            EXPECT_EQ(trainer->objects(), training_.batch_size / ranks);
            EXPECT_EQ(trainer->first_object(), rank * trainer->objects());
            if (state != nullptr) {
                EXPECT_OK(trainer->resume(*state));
            }
            for (std::uint64_t i = first; i < end; ++i)
                EXPECT_OK(trainer->step(part(batch_(i), rank, ranks), i % 2 == 0));
            EXPECT_OK(trainer->read());
            all[rank].steps.assign(trainer->results().begin(), trainer->results().end());
            all[rank].state = need(trainer->checkpoint());
            all[rank].average = need(trainer->averaged_state());
        });
        return all;
    }

    static void expect_equal(const Trained& got, const Trained& expected) {
        const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
        EXPECT_EQ(got.state.metadata, expected.state.metadata);  // with a checksum of all tensors
        EXPECT_EQ(io::crc32_of(got.average), io::crc32_of(expected.average));
        ASSERT_EQ(got.steps.size(), expected.steps.size());
        for (std::size_t i = 0; i < got.steps.size(); ++i) {
            const TrainStep &a = got.steps[i], &b = expected.steps[i];
            EXPECT_EQ(bits(a.loss.total), bits(b.loss.total)) << i;
            EXPECT_EQ(bits(a.loss.of("ssim")), bits(b.loss.of("ssim"))) << i;
            EXPECT_EQ(a.step, b.step) << i;
            EXPECT_EQ(a.skipped, b.skipped) << i;
            EXPECT_EQ(a.pairs, b.pairs) << i;
            EXPECT_EQ(a.visible, b.visible) << i;
            EXPECT_EQ(a.culled, b.culled) << i;
            EXPECT_EQ(a.non_finite, b.non_finite) << i;
            EXPECT_EQ(a.gradients_zero, b.gradients_zero) << i;
            EXPECT_EQ(a.rate, b.rate) << i;
        }
    }

    /// All ranks of several numbers of them know the same. Returns what one rank does.
    Trained expect_the_same(std::uint64_t steps,
                            std::initializer_list<std::uint32_t> numbers) const {
        const Trained single = train(1, 0, steps)[0];
        EXPECT_EQ(single.steps[0].exchange_bytes, 0U);
        for (const std::uint32_t ranks : numbers) {
            const std::vector<Trained> all = train(ranks, 0, steps);
            for (std::uint32_t rank = 0; rank < ranks; ++rank) {
                SCOPED_TRACE(format("rank %u of %u", rank, ranks));
                expect_equal(all[rank], single);
                EXPECT_GT(all[rank].steps[0].exchange_bytes, 0U);
                EXPECT_GT(all[rank].steps[0].exchange_seconds, 0);
            }
        }
        return single;
    }

    model::ModelConfig network_ = small_network();
    TrainConfig training_ = small_training();
    std::function<Batch(std::uint64_t)> batch_ = [this](std::uint64_t i) {
        return Batch(network_, training_, 100 + i);
    };
};

/// With dropout, whose pass number is of the whole batch; averages; and a loss that is infinite on one rank only, with
/// finite gradients.
TEST_F(TrainerGroup, HasTheBitsOfOneRank) {
    batch_ = [this](std::uint64_t i) {
        Batch made(network_, training_, 100 + i);
        if (i == 1) made.targets.back() = 1e30F;
        return made;
    };
    const Trained single = expect_the_same(3, {2, 4});
    EXPECT_TRUE(single.steps[1].skipped && !single.steps[2].skipped);
    EXPECT_EQ(single.steps.back().step, 2U);
    training_.batch_size = 12;  // trees of three passes
    training_.micro_batch = 2;
    expect_the_same(2, {2});
}

TEST_F(TrainerGroup, TrainsAdapters) {
    network_.lora.rank = 2;
    network_.lora.dropout = 0.2F;
    expect_the_same(2, {2});
}

/// Means over the outliers of the batch, of which two objects have others than the rest.
TEST_F(TrainerGroup, SharesScaleTerms) {
    network_.init_scale = {1, 20};
    training_.scale_terms = true;
    batch_ = [this](std::uint64_t i) {
        Batch made(network_, training_, 100 + i);
        const std::size_t each = made.images.size() / 4;
        std::fill_n(made.images.begin() + static_cast<std::ptrdiff_t>(each), 2 * each, 0.5F);
        return made;
    };
    const Trained with = expect_the_same(2, {2, 4});
    training_.scale_terms = false;
    const Trained without = train(1, 0, 1)[0];
    EXPECT_GT(with.steps[0].loss.total, without.steps[0].loss.total + 1);
}

/// Each object has planes of its own.
TEST_F(TrainerGroup, SharesPlanes) {
    training_.plane_weight = 20;
    EXPECT_GT(expect_the_same(2, {2}).steps[0].loss.of("plane"), 0);
}

/// All that ranks must not do differently, at once and for longer: dropout, averages, CO3D's geometry and terms,
/// skipped steps, and adapters besides all weights.
TEST_F(TrainerGroup, HaveTheBitsOfOneRankForFiftySteps) {
    constexpr std::uint64_t kSteps = 50;
    network_.fov_degrees = 0;
    network_.origin_distance = true;
    network_.init_scale = {1, 20};
    training_.scale_terms = true;
    batch_ = [this](std::uint64_t i) {
        Batch made(network_, training_, 100 + i);
        if (i % 20 == 1) made.targets.back() = 1e30F;
        return made;
    };
    for (const std::uint32_t rank : {0U, 2U}) {
        network_.lora.rank = rank;
        network_.lora.dropout = 0.2F;
        const Trained single = expect_the_same(kSteps, {2, 4});
        EXPECT_EQ(single.steps.back().step, kSteps - 3);
    }
}

/// LPIPS begins on both ranks after the first update, which a skipped step puts off.
TEST_F(TrainerGroup, BeginsLpipsTogether) {
    const std::string folder = testing::TempDir() + "/lpips_of_ranks";
    std::filesystem::create_directory(folder);
    network_.resolution = 16;  // the least that VGG16 takes
    training_.batch_size = 2;
    training_.lpips_weight = 0.5;
    training_.lpips_after = 1;
    training_.lpips_weights = save_lpips_weights(folder);
    batch_ = [this](std::uint64_t i) {
        Batch made(network_, training_, 100 + i);
        if (i == 0) made.targets.back() = 1e30F;
        return made;
    };
    const Trained single = expect_the_same(3, {2});
    EXPECT_TRUE(single.steps[0].skipped);
    EXPECT_EQ(single.steps[1].loss.of("lpips"), 0);
    EXPECT_GT(single.steps[2].loss.of("lpips"), 0);
    std::filesystem::remove_all(folder);
}

/// A state of two ranks goes on with one and with four.
TEST_F(TrainerGroup, ResumesWithAnotherNumberOfRanks) {
    const std::vector<Trained> begun = train(2, 0, 1);
    const Trained whole = train(1, 0, 2)[0];
    for (const std::uint32_t ranks : {1U, 4U}) {
        const Trained end = train(ranks, 1, 2, &begun[0].state)[ranks - 1];
        EXPECT_EQ(end.state.metadata, whole.state.metadata) << ranks;
    }
}

TEST_F(TrainerGroup, ErrorsOfARankAreThoseOfAll) {
    const Batch good = batch_(0);
    Batch bad = batch_(0);
    bad.targets[bad.targets.size() / 2] = NAN;
    const Trained expected = train(1, 0, 1)[0];
    on_ranks(4, [&](vk::Context& context, run::Group* group, std::uint32_t rank) {
        const auto trainer = make(context, group);
        TrainStep step;
        EXPECT_ERROR(trainer->step(part(bad, rank, 4), step), Code::kInvalidArgument,
                     "rank 2: training batch: targets hold nan");
        EXPECT_EQ(trainer->attempts(), 0U);
        EXPECT_OK(trainer->step(part(good, rank, 4), step));
        EXPECT_EQ(need(trainer->checkpoint()).metadata, expected.state.metadata);
    });
}

TEST_F(TrainerGroup, BatchesMustDivide) {
    training_.batch_size = 12;
    training_.micro_batch = 2;
    on_ranks(4, [&](vk::Context& context, run::Group* group, std::uint32_t) {
        EXPECT_ERROR(Trainer::create(context, network_, training_, group), Code::kInvalidArgument,
                     "'opt.batch_size' is 12, expected a multiple of ranks times opt.micro_batch, "
                     "4 x 2");
    });
}

}  // namespace
}  // namespace splat::test
