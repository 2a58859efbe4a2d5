// Lists in levels of dependency: the same bits in fewer levels, and on CPU devices the memory of before.
#include <gtest/gtest.h>

#include "nn/executor.h"
#include "ops/op_harness.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/log_capture.h"
#include "support/parsed_json.h"
#include "support/require_vulkan.h"
#include "support/rng_fill.h"
#include "support/system.h"

namespace splat::test {
namespace {

using nn::ValueId;

constexpr std::uint32_t kChannels = 8, kSide = 12;

struct Outcome {
    std::vector<std::vector<float>> values;
    std::uint64_t levels = 0;  ///< the backward pass's
    std::uint64_t arenas = 0;
    std::uint64_t bound = 0;
    std::uint64_t peak = 0;  ///< bytes of the device
};

std::vector<float> get(vk::Context& context, const vk::BufferView& view) {
    std::vector<float> values(view.shape.elements());
    EXPECT_OK(context.read(view, values.data(), 4 * values.size()));
    return values;
}

void put(vk::Context& context, const vk::BufferView& view, std::uint64_t seed) {
    const std::vector<float> values = normal_fill(view.shape.elements(), seed);
    EXPECT_OK(context.write(view, values.data(), 4 * values.size()));
}

/// A chain of trained convolutions of 3 x 3, forward and backward.
Outcome run_chain(const std::shared_ptr<vk::Context>& context, int convolutions, int winograd) {
    nn::Graph graph(*context);
    const ValueId x = graph.input("x", {1, kChannels, kSide, kSide});
    ValueId y = x;
    std::vector<ValueId> weights;
    for (int i = 0; i < convolutions; ++i) {
        weights.push_back(
            graph.parameter("weight" + std::to_string(i), {kChannels, kChannels, 3, 3}));
        weights.push_back(graph.parameter("bias" + std::to_string(i), {kChannels}));
        y = graph.op("conv2d", {y, weights[weights.size() - 2], weights.back()},
                     {{"winograd", std::int64_t{winograd}}});
    }
    nn::Parameters parameters = need(nn::Parameters::create(*context, graph));
    for (const ValueId id : weights) put(*context, parameters.of(id).value, id);
    parameters.changed();
    EXPECT_OK(parameters.zero_gradients());
    const auto executor = need(nn::Executor::create(*context, graph, parameters,
                                                    {.outputs = {y},
                                                     .backward = true,
                                                     .grad_outputs = {y},
                                                     .grad_inputs = {x},
                                                     .quads = {x, y}}));
    put(*context, executor->tensor(x), 91);
    put(*context, executor->gradient(y), 92);
    EXPECT_OK(executor->forward());
    Outcome outcome;
    outcome.values.push_back(get(*context, executor->tensor(y)));
    context->profile()->reset();
    EXPECT_OK(executor->backward());
    const Json lists = parse_json(context->profile()->json("x"), "profile").value()["lists"];
    EXPECT_EQ(lists["count"], 1);
    outcome.levels = lists["levels"].get<std::uint64_t>();
    outcome.values.push_back(get(*context, executor->gradient(x)));
    for (const ValueId id : weights)
        outcome.values.push_back(get(*context, parameters.of(id).grad));
    outcome.arenas = executor->memory().arenas;
    outcome.bound = executor->memory().bound;
    outcome.peak = context->memory().use().peak;
    return outcome;
}

void expect_same_bits(const Outcome& before, const Outcome& after) {
    ASSERT_EQ(before.values.size(), after.values.size());
    for (std::size_t i = 0; i < before.values.size(); ++i)
        EXPECT_TRUE(
            bit_equal(before.values[i], after.values[i], {"tensor " + std::to_string(i), ""}));
}

class ExecutorLevels : public KernelsTest {
  protected:
    /// Allocations are as large as asked for.
    [[nodiscard]] static std::shared_ptr<vk::Context> open(bool levels, std::uint64_t budget = 0) {
        vk::ContextDesc desc = context_desc(GetParam());
        desc.profile = true;
        desc.memory.block_bytes = 1024;
        desc.memory.budget_bytes = budget;
        desc.device.fake = [levels](vk::DeviceInfo& info) { info.features.levels = levels; };
        return make_context(desc);
    }
};
SPLAT_INSTANTIATE_KERNELS(ExecutorLevels);

TEST_P(ExecutorLevels, SameBitsInAtMostFourLevelsAConvolution) {
    const auto ordered = open(false);
    const auto levelled = open(true);
    if (ordered->device().info().limits.timestamp_ns <= 0)
        SPLAT_SKIP_FOR_DEVICE("this device has no timestamps");
    for (const int winograd : {0, 4})
        for (const int convolutions : {1, 3}) {
            if (winograd != 0 && GetParam() == vk::Kernels::kPlain) continue;  // they ignore it
            const Outcome before = run_chain(ordered, convolutions, winograd);
            const Outcome after = run_chain(levelled, convolutions, winograd);
            expect_same_bits(before, after);
            EXPECT_LE(after.levels, 4U * static_cast<unsigned>(convolutions)) << winograd;
            EXPECT_LT(after.levels, before.levels + (convolutions == 1 ? 1 : 0)) << winograd;
            EXPECT_GE(after.arenas, before.arenas);
            std::printf(
                "[ levels   ] %d convolutions, winograd %d: %llu levels, before %llu; "
                "arenas of %llu bytes, before %llu\n",
                convolutions, winograd, llu(after.levels), llu(before.levels), llu(after.arenas),
                llu(before.arenas));
        }
}

/// What levels cost is left out where it is more than allowed, and where the device has less: the bits stay.
TEST_P(ExecutorLevels, TakeWhatOthersDoWhereMemoryIsShort) {
    const int winograd = GetParam() == vk::Kernels::kPlain ? 0 : 4;
    const auto ordered = open(false);
    if (ordered->device().info().limits.timestamp_ns <= 0)
        SPLAT_SKIP_FOR_DEVICE("this device has no timestamps");
    const Outcome least = run_chain(ordered, 3, winograd);
    const Outcome most = run_chain(open(true), 3, winograd);
    EXPECT_GT(most.arenas, least.arenas);

    test::set_variable("SPLAT_LEVELS_MEMORY", "1e-9");
    const Outcome bounded = run_chain(open(true), 3, winograd);
    test::set_variable("SPLAT_LEVELS_MEMORY", "0");
    const auto levelled = open(true);
    const nn::Graph empty(*levelled);
    nn::Parameters none = need(nn::Parameters::create(*levelled, empty));
    EXPECT_ERROR(nn::Executor::create(*levelled, empty, none, {}), Code::kInvalidArgument,
                 "SPLAT_LEVELS_MEMORY is '0'");
    test::unset_variable("SPLAT_LEVELS_MEMORY");
    expect_same_bits(least, bounded);
    EXPECT_EQ(bounded.arenas, least.arenas);
    EXPECT_LE(bounded.levels, least.levels);

    const auto scarce = open(true, (least.peak + most.peak) / 2);
    const LogCapture log(LogLevel::kInfo);
    const Outcome fallen = run_chain(scarce, 3, winograd);
    expect_same_bits(least, fallen);
    EXPECT_EQ(fallen.arenas, least.arenas);
    EXPECT_EQ(fallen.peak, least.peak);
    EXPECT_NE(log.text().find("less runs side by side, in less memory: activations: needs"),
              std::string::npos)
        << log.text();
}

}  // namespace
}  // namespace splat::test
