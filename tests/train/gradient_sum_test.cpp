#include "train/gradient_sum.h"

#include <algorithm>
#include <atomic>

#include "ops/add.h"
#include "support/gpu_buffers.h"
#include "train/rank_contexts.h"

namespace splat::test {
namespace {

using train::GradientSum;

/// The sum over slices first ... first + count - 1 of number `at`, by the definition of the tree.
float tree(const std::vector<std::vector<float>>& slices, std::size_t at, std::size_t first,
           std::size_t count) {
    if (count % 2 == 0)
        return tree(slices, at, first, count / 2) + tree(slices, at, first + count / 2, count / 2);
    float sum = 0;
    for (std::size_t i = first; i < first + count; ++i) sum += slices[i][at];
    return sum;
}

/// A network's parameters, with slices that add some numbers to their gradients.
class Slices {
  public:
    Slices(vk::Context& context, std::uint32_t width) : context_(context) {
        nn::Graph graph(context);
        graph.parameter("w", Shape{width, width});
        graph.parameter("b", Shape{5});
        parameters.emplace(need(nn::Parameters::create(context, graph)));
        bytes_ = parameters->blocks()[0].grads.bytes;
    }
    [[nodiscard]] std::size_t size() const { return bytes_ / 4; }
    Status add(const std::vector<float>& numbers) {
        const vk::BufferView& sum = parameters->blocks()[0].grads;
        kept_.push_back(upload(context_, numbers));
        const vk::BufferView slice = kept_.back().range();
        vk::Recorder recorder(context_);
        const ops::AddDesc desc{{.n = static_cast<std::uint32_t>(bytes_ / 16), .c = 4}};
        SPLAT_TRY(ops::add_forward(recorder, desc, sum, slice, sum));
        SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
        return context_.run(list);
    }
    std::vector<float> gradients() {
        return download(context_, parameters->blocks()[0].grads, size());
    }
    std::optional<nn::Parameters> parameters;

  private:
    vk::Context& context_;
    std::uint64_t bytes_ = 0;
    std::vector<vk::Buffer> kept_;
};

class GradientSums : public RankContexts {
  protected:
    static std::vector<std::vector<float>> numbers(std::uint32_t slices, std::size_t size) {
        std::vector<std::vector<float>> all;
        for (std::uint32_t i = 0; i < slices; ++i) all.push_back(normal_fill(size, 50 + i, 0.1, 1));
        return all;
    }
};

/// Twice, the second time on top of the first: by ranks that divide the trees, over several pieces and over less than a
/// part for each rank.
TEST_F(GradientSums, AreThoseOfTheTree) {
    for (const std::uint32_t width : {3U, 1500U})
        for (const std::uint32_t slices : {1U, 3U, 4U, 12U, 16U})
            for (const std::uint32_t ranks : {1U, 2U, 4U}) {
                if (slices % ranks != 0 || (width > 3 && (slices != 4 || ranks != 4))) continue;
                SCOPED_TRACE(
                    format("%u numbers squared, %u slices, %u ranks", width, slices, ranks));
                const auto all = numbers(2 * slices, Slices(rank_context(0), width).size());
                std::vector<float> expected;
                for (std::size_t at = 0; at < all[0].size(); ++at) {
                    const float first = tree(all, at, 0, slices);
                    expected.push_back(first + tree(all, at, slices, slices));
                    float in_order = first;
                    for (std::uint32_t i = 0; i < slices; ++i) in_order += all[slices + i][at];
                    if (slices % 2 == 1) expected.back() = in_order;
                }
                on_ranks(ranks, [&](vk::Context& context, run::Group* group, std::uint32_t rank) {
                    Slices made(context, width);
                    auto sum =
                        need(GradientSum::create(context, *made.parameters, slices, group, true));
                    const std::uint32_t first = rank * slices / ranks;
                    double seconds = 0;
                    EXPECT_OK(sum.sum(
                        [&](std::uint32_t i, auto&) { return made.add(all[first + i]); }, seconds));
                    EXPECT_OK(sum.add(
                        [&](std::uint32_t i, auto&) { return made.add(all[slices + first + i]); },
                        seconds));
                    EXPECT_TRUE(made.gradients() == expected);
                    EXPECT_EQ(seconds > 0, group != nullptr);
                });
            }
}

/// A slice that fails on one rank is every rank's error, and the next sum is right.
TEST_F(GradientSums, FailOnAllRanks) {
    on_ranks(4, [](vk::Context& context, run::Group* group, std::uint32_t rank) {
        Slices made(context, 3);
        auto sum = need(GradientSum::create(context, *made.parameters, 8, group, false));
        double seconds = 0;
        const std::vector<float> ones(made.size(), 1.0F);
        const Status failed = sum.sum(
            [&](std::uint32_t i, auto&) {
                return rank == 2 && i == 1 ? invalid("no more") : made.add(ones);
            },
            seconds);
        EXPECT_ERROR(failed, Code::kInvalidArgument, "rank 2: no more");
        EXPECT_OK(sum.sum([&](std::uint32_t, auto&) { return made.add(ones); }, seconds));
        EXPECT_EQ(made.gradients().front(), 8.0F);
    });
}

/// A group that sums by itself gets the sums of ranks.
TEST_F(GradientSums, CanBeThoseOfTheGroup) {
    static std::atomic<int> calls;
    calls = 0;
    ThreadGroup threads(2);
    threads.run([&](run::GroupCalls given) {
        given.sum = [](void*, float* values, std::uint64_t count) {
            ++calls;
            std::for_each(values, values + count, [](float& value) { value += 100; });
            return 0;
        };
        run::Group group(given);
        Slices made(rank_context(given.rank), 3);
        auto sum =
            need(GradientSum::create(rank_context(given.rank), *made.parameters, 4, &group, false));
        double seconds = 0;
        const std::vector<float> ones(made.size(), 1.0F);
        EXPECT_OK(sum.sum([&](std::uint32_t, auto&) { return made.add(ones); }, seconds));
        EXPECT_EQ(made.gradients(), std::vector<float>(made.size(), 102.0F));
        EXPECT_GE(group.bytes_sent(), 4 * made.size());
    });
    EXPECT_EQ(calls, 2);
}

}  // namespace
}  // namespace splat::test
