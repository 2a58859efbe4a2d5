#include "train/batches.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "synthetic/sample_folder.h"

namespace splat::train {
namespace {

constexpr std::uint64_t kSeed = 5;

class BatchesTest : public testing::Test {
  protected:
    void SetUp() override {
        desc_ = test::sample_cars(folder_ / "cars");
        test::write_all(desc_);
        settings_.network.resolution = desc_.resolution;
        settings_.training.root = desc_.path;
        settings_.training.batch_size = 1;
        settings_.training.targets = 2;
    }
    std::shared_ptr<const predict::ViewSource> data() {
        auto made = predict::ViewSource::open(settings_, "", "train");
        EXPECT_OK(made);
        return made.ok() ? std::shared_ptr(std::move(made.value())) : nullptr;
    }
    PrefetchPointer prefetch(std::size_t threads = 1) {
        return need(Prefetch::create(BatchSource(data(), settings_, kSeed), threads));
    }

    test::SampleFolder folder_;
    synthetic::WriterDesc desc_;
    config::Settings settings_;
};

void expect_equal(const Batch& a, const Batch& b) {
    EXPECT_EQ(a.images, b.images);
    EXPECT_EQ(a.levels, b.levels);
    EXPECT_EQ(a.view_to_world, b.view_to_world);
    EXPECT_EQ(a.quaternions, b.quaternions);
    EXPECT_EQ(a.cameras.size(), b.cameras.size());
}

/// The order of objects and views of version 0.1, computed by hand; resumed runs depend on it.
TEST_F(BatchesTest, OrderIsThatOfEarlierRuns) {
    const auto source = data();
    ASSERT_NE(source, nullptr);
    const BatchSource batches(source, settings_, kSeed);
    struct Visit {
        std::uint32_t object;
        std::uint32_t views[2];
    };
    constexpr Visit kVisits[] = {{0, {2, 0}}, {1, {2, 1}}, {1, {1, 2}},
                                 {0, {0, 2}}, {1, {0, 1}}, {0, {1, 2}}};
    for (std::size_t n = 0; n < std::size(kVisits); ++n) {
        const Visit& visit = kVisits[n];
        const auto batch = need(batches.make(n));
        const std::uint32_t numbers[] = {visit.views[0], visit.views[0], visit.views[1]};
        const auto views = need(source->read(visit.object, numbers, 1));
        EXPECT_EQ(batch.images, views.inputs) << n;
        const std::size_t plane = views.images.size() / 3;
        ASSERT_EQ(batch.levels.size(), 2 * plane);
        for (std::size_t i = 0; i < 2 * plane; ++i)
            ASSERT_EQ(static_cast<float>(batch.levels[i]) / 255.0F, views.images[plane + i]) << n;
        EXPECT_EQ(batch.cameras.size(), 2U);
        EXPECT_TRUE(batch.focals.empty());
    }
}

/// A last plane of the inputs, of the nearness that the data set's maps hold.
TEST_F(BatchesTest, DepthsOfTheHeadAreInSceneUnits) {
    settings_.network.depth = true;
    const Batch shown = need(BatchSource(data(), settings_, kSeed).make(0));
    settings_.network.depth = false;
    settings_.network.positions = kHeadInputDepth;
    const Batch batch = need(BatchSource(data(), settings_, kSeed).make(0));
    const std::size_t area = std::size_t{desc_.resolution} * desc_.resolution;
    ASSERT_EQ(batch.images.size(), 4 * area);
    const std::vector<float>& nearness = shown.images;
    float least = 9, most = 0;
    for (std::size_t i = 0; i < area; ++i) {
        const float depth = batch.images[3 * area + i];
        const float inverse = 1 / 1.8F + nearness[3 * area + i] * (1 / 0.8F - 1 / 1.8F);
        ASSERT_NEAR(depth, 1 / inverse, 1e-5) << i;
        least = std::min(least, depth);
        most = std::max(most, depth);
    }
    EXPECT_NEAR(most, 1.8F, 1e-5) << "behind the object";
    EXPECT_LT(least, 0.82F);
}

/// A loss takes planes of the input view alone.
TEST_F(BatchesTest, HaveThePlanesOfTheirInputs) {
    test::put_planes(desc_.path);
    EXPECT_TRUE(need(BatchSource(data(), settings_, kSeed).make(0)).planes.empty());
    settings_.training.plane_weight = 0.1;
    settings_.training.batch_size = 2;
    const auto source = data();
    ASSERT_NE(source, nullptr);
    const Batch batch = need(BatchSource(source, settings_, kSeed).make(0));
    ASSERT_EQ(batch.planes.size(), std::size_t{2} * 5 * 16 * 16);
    EXPECT_EQ(batch.view().planes.data(), batch.planes.data());
    const std::uint32_t first[] = {2};  // see the order above
    const std::vector<float> planes = need(source->read(0, first, 1)).planes;
    ASSERT_EQ(planes.size(), std::size_t{5} * 16 * 16);
    EXPECT_TRUE(std::equal(planes.begin(), planes.end(), batch.planes.begin()));
}

TEST_F(BatchesTest, AnyNumberCanBeReadAtAnyTime) {
    const BatchSource source(data(), settings_, kSeed);
    for (const std::size_t threads : {1, 2, 5}) {
        const auto batches = prefetch(threads);
        ASSERT_NE(batches, nullptr);
        for (const std::uint64_t n : {0, 1, 2, 7, 8, 3, 3, 4, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9}) {
            const auto got = need(batches->get(n));
            const auto expected = need(source.make(n));
            expect_equal(got, expected);
        }
    }
}

TEST_F(BatchesTest, ThreadsEndWhileTheyMakeBatches) {
    for (const std::uint64_t n : {0, 1, 2, 3}) {
        const auto batches = prefetch(5);
        ASSERT_NE(batches, nullptr);
        for (std::uint64_t i = 0; i < n; ++i) EXPECT_OK(batches->get(i * i));
    }
}

/// One less than the cores may be none.
TEST_F(BatchesTest, ThreadsAreThoseAskedFor) {
    EXPECT_EQ(loader_threads(settings_.training, true), 1U);
    EXPECT_GE(loader_threads(settings_.training, false), 1U);
    EXPECT_LE(loader_threads(settings_.training, false), 4U);
    settings_.training.loader_threads = 7;
    EXPECT_EQ(loader_threads(settings_.training, true), 7U);
}

/// Batches 1, 2 and 4 show the second object, whose files are away.
TEST_F(BatchesTest, AnErrorComesInItsTurn) {
    for (const std::size_t threads : {1, 2, 5}) {
        const auto batches = prefetch(threads);
        ASSERT_NE(batches, nullptr);
        const BatchSource source(data(), settings_, kSeed);
        const std::filesystem::path object = data()->dataset().index().folders[1];
        const auto away = folder_ / "away";
        std::filesystem::rename(object, away);
        EXPECT_OK(batches->get(0));
        EXPECT_FALSE(batches->get(1).ok());
        EXPECT_FALSE(batches->get(2).ok());
        EXPECT_OK(batches->get(3));
        EXPECT_FALSE(batches->get(4).ok());
        std::filesystem::rename(away, object);
        for (const std::uint64_t n : {4, 5, 6}) {
            const auto got = need(batches->get(n));
            expect_equal(got, need(source.make(n)));
        }
    }
}

TEST_F(BatchesTest, AnErrorComesOutOfItsBatchAndIsTriedAgain) {
    const auto batches = prefetch();
    ASSERT_NE(batches, nullptr);
    const auto object = folder_ / "cars/srn_cars/cars_train";
    const auto away = folder_ / "away";
    std::filesystem::rename(object, away);
    EXPECT_FALSE(batches->get(0).ok());
    EXPECT_FALSE(batches->get(0).ok());
    std::filesystem::rename(away, object);
    EXPECT_OK(batches->get(0));
    EXPECT_OK(batches->get(1));
}

TEST_F(BatchesTest, TooFewViewsAreRefused) {
    settings_.network.views = 3;
    EXPECT_ERROR(BatchSource(data(), settings_, 0).check(), Code::kFormat,
                 "has 3 views, expected at least 4");
}

/// Means of 2 x 2 pixels, seen by the same camera with half as many.
TEST_F(BatchesTest, TargetsMayBeSmaller) {
    const Batch whole = need(BatchSource(data(), settings_, kSeed).make(3));
    const std::uint32_t side = desc_.resolution / 2;
    settings_.training.target_resolution = side;
    const Batch half = need(BatchSource(data(), settings_, kSeed).make(3));
    EXPECT_EQ(half.images, whole.images);
    EXPECT_TRUE(half.levels.empty());
    ASSERT_EQ(half.targets.size(), whole.levels.size() / 4);
    for (std::size_t i = 0; i < half.targets.size(); ++i) {
        const std::size_t at = i / side * 4 * side + i % side * 2;
        int sum = 0;
        for (const std::size_t next : {0U, 1U, 2 * side, 2 * side + 1})
            sum += whole.levels[at + next];
        ASSERT_NEAR(half.targets[i], sum / 1020.0, 1e-7) << i;
    }
    ASSERT_EQ(half.cameras.size(), whole.cameras.size());
    EXPECT_EQ(half.cameras[1].width, side);
    EXPECT_EQ(half.cameras[1].fx, whole.cameras[1].fx / 2);
    EXPECT_EQ(half.cameras[1].cy, whole.cameras[1].cy / 2);
    EXPECT_EQ(half.cameras[1].world_to_camera, whole.cameras[1].world_to_camera);
}

/// A stage with other batches goes on in the sequence of objects where the one before it ended.
TEST_F(BatchesTest, BeginWhereOthersEnded) {
    BatchSource source(data(), settings_, kSeed);
    source.begin_at(5, 8);
    EXPECT_EQ(source.object_of(7), 10U);
    expect_equal(need(source.make(7)), need(BatchSource(data(), settings_, kSeed).make(10)));
}

TEST_F(BatchesTest, ALargerBatchHoldsTheObjectsInTurn) {
    settings_.training.batch_size = 2;
    const BatchSource pairs(data(), settings_, kSeed);
    settings_.training.batch_size = 1;
    const BatchSource single(data(), settings_, kSeed);
    const auto pair = need(pairs.make(1));
    const auto first = need(single.make(2)), second = need(single.make(3));
    std::vector<float> both = first.images;
    both.insert(both.end(), second.images.begin(), second.images.end());
    EXPECT_EQ(pair.images, both);
    EXPECT_EQ(pair.view().cameras.size(), 4U);
}

}  // namespace
}  // namespace splat::train
