#include "vk/levels.h"

#include <gtest/gtest.h>

#include <bit>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "test_shaders.h"
#include "vk/hazard.h"

namespace splat::vk {
namespace {

using namespace test;

/// Commands without a device, on parts of three buffers.
std::vector<Command> random_commands(std::uint64_t seed, std::size_t count) {
    Rng rng(seed);
    std::vector<Command> commands(count);
    for (Command& command : commands) {
        command.recorded = static_cast<std::size_t>(&command - commands.data());
        command.kind = rng.below(3) == 0 ? CommandKind::kCopy : CommandKind::kDispatch;
        for (std::uint64_t i = 1 + rng.below(4); i > 0; --i) {
            BufferView view;
            view.buffer = std::bit_cast<VkBuffer>(std::uintptr_t{16} * (1 + rng.below(3)));
            view.offset = 16 * rng.below(64);
            view.bytes = 16 * (1 + rng.below(8));
            command.accesses.push_back({view, static_cast<Use>(rng.below(3))});
        }
    }
    return commands;
}

bool conflict(const Command& a, const Command& b) {
    for (const Access& x : a.accesses)
        for (const Access& y : b.accesses)
            if (x.view.overlaps(y.view) && (writes(x.use) || writes(y.use))) return true;
    return false;
}

TEST(Levels, AreThoseOfAllPairs) {
    for (std::uint64_t seed = 1; seed < 40; ++seed) {
        const std::vector<Command> commands = random_commands(seed, 200);
        for (const bool in_order : {false, true}) {
            std::vector<std::uint32_t> expected;
            for (std::size_t i = 0; i < commands.size(); ++i) {
                std::uint32_t level = in_order && i > 0 ? expected.back() : 1;
                for (std::size_t j = 0; j < i; ++j)
                    if (conflict(commands[j], commands[i]))
                        level = std::max(level, expected[j] + 1);
                expected.push_back(level);
            }
            ASSERT_EQ(dependency_levels(commands, in_order), expected) << seed << in_order;
        }
    }
    EXPECT_TRUE(dependency_levels({}, false).empty());
    EXPECT_TRUE(in_levels({}, {}).empty());
}

/// Every barrier, each stage after it and the order of every two commands that conflict are found to be needed.
TEST(Levels, HazardsOfEveryMutationAreFound) {
    for (std::uint64_t seed = 1; seed < 10; ++seed) {
        const std::vector<Command> commands = random_commands(seed, 60);
        const std::vector<Command> list = in_levels(commands, dependency_levels(commands, false));
        ASSERT_OK(check_hazards(list));
        for (std::size_t i = 0; i < list.size(); ++i) {
            std::vector<Command> mutant = list;
            if (is_barrier(list[i])) {
                mutant.erase(mutant.begin() + static_cast<std::ptrdiff_t>(i));
                EXPECT_FALSE(check_hazards(mutant).ok()) << "barrier " << i;
                for (const Stages stage : {kShaders, kTransfers}) {
                    Stages Command::*const side =
                        list[i].kind == CommandKind::kToHost ? &Command::from : &Command::to;
                    if ((list[i].*side & stage) == 0) continue;
                    mutant = list;
                    mutant[i].*side &= ~stage;
                    EXPECT_FALSE(check_hazards(mutant).ok()) << "barrier " << i << ", " << stage;
                }
                continue;
            }
            for (std::size_t j = 0; j < i; ++j) {
                if (is_barrier(list[j]) || !conflict(list[j], list[i])) continue;
                mutant = list;
                std::swap(mutant[i], mutant[j]);
                EXPECT_FALSE(check_hazards(mutant).ok()) << j << " and " << i;
            }
        }
    }
}

TEST(Levels, TheOrderOfTheListIsNamedInTheError) {
    std::vector<Command> commands = random_commands(1, 2);
    commands[1].accesses = commands[0].accesses = {{commands[0].accesses[0].view, Use::kWrite}};
    std::swap(commands[0].recorded, commands[1].recorded);
    EXPECT_ERROR(check_hazards(in_levels(commands, dependency_levels(commands, false))),
                 Code::kInternal, "in another order than they were recorded");
}

class LevelsOnADevice : public testing::Test {
  protected:
    static std::shared_ptr<Context> open(bool levels) {
        ContextDesc desc = context_desc();
        desc.device.fake = [levels](DeviceInfo& info) { info.features.levels = levels; };
        return make_context(desc);
    }

    static std::vector<std::string> ops_of(const CommandList& list) {
        std::vector<std::string> ops;
        for (const Command& command : list.commands()) ops.push_back(command.op);
        return ops;
    }
};

TEST_F(LevelsOnADevice, IndependentWorkLiesBetweenTwoBarriers) {
    const auto context = open(true);
    const Buffer a = device_buffer(*context, 256);
    const Buffer b = device_buffer(*context, 256);
    const Buffer c = device_buffer(*context, 256);
    const Buffer d = device_buffer(*context, 256);
    const Buffer e = device_buffer(*context, 256);
    Recorder r(*context);
    EXPECT_OK(r.dispatch(scale(e.range(), a.range(), 256, 2)));
    EXPECT_OK(r.dispatch(scale(a.range(), b.range(), 256, 2)));
    EXPECT_OK(r.dispatch(accumulate(b.range(), a.range(), 256)));
    EXPECT_OK(r.fill(c.range(), 0));
    EXPECT_OK(r.copy(c.range(), d.range()));
    CommandList list = need(r.finish());
    EXPECT_EQ(ops_of(list),
              (std::vector<std::string>{"barrier", "scale", "fill", "barrier", "scale", "copy",
                                        "barrier", "accumulate", "to_host"}));
    std::vector<std::pair<Stages, Stages>> stages;
    for (const Command& command : list.commands())
        if (is_barrier(command)) stages.emplace_back(command.from, command.to);
    EXPECT_EQ(stages, (std::vector<std::pair<Stages, Stages>>{{kAllStages, kAllStages},
                                                              {kAllStages, kAllStages},
                                                              {kAllStages, kShaders},
                                                              {kAllStages, kHost}}));
    EXPECT_OK(context->run(list));
}

TEST_F(LevelsOnADevice, BarriersOfDispatchesNameNothingElse) {
    const auto context = open(false);
    const Buffer a = device_buffer(*context, 256);
    const Buffer b = device_buffer(*context, 256);
    Recorder r(*context);
    for (int i = 0; i < 3; ++i) {
        EXPECT_OK(r.dispatch(scale(a.range(), b.range(), 256, 2)));
        EXPECT_OK(r.dispatch(scale(b.range(), a.range(), 256, 2)));
    }
    CommandList list = need(r.finish());
    std::size_t barriers = 0;
    for (const Command& command : list.commands()) {
        if (!is_barrier(command)) continue;
        const bool host = command.kind == CommandKind::kToHost;
        EXPECT_EQ(command.from, barriers == 0 ? kAllStages : kShaders) << "lists before had copies";
        EXPECT_EQ(command.to, host ? kHost : kShaders);
        ++barriers;
    }
    EXPECT_EQ(barriers, 7U);
    EXPECT_OK(context->run(list));
}

/// Random lists leave the same bits in levels and in order, under synchronisation validation.
TEST_F(LevelsOnADevice, SameBitsAsInOrder) {
    constexpr std::uint64_t kQuads = 64;  // a buffer has
    std::vector<std::vector<std::uint32_t>> first;
    std::size_t barriers[2] = {};
    for (const bool levels : {false, true}) {
        const auto context = open(levels);
        for (std::uint64_t seed = 1; seed <= 6; ++seed) {
            Rng rng(seed);
            std::vector<Buffer> buffers;
            for (int i = 0; i < 4; ++i)
                buffers.push_back(upload(*context, integer_fill(4 * kQuads, seed + i)));
            const auto view = [&](std::uint64_t buffer, std::uint64_t quads) {
                const std::uint64_t step = context->device().info().limits.offset_alignment;
                const std::uint64_t last = (16 * kQuads - 16 * quads) / step;
                return buffers[buffer].range().part(step * rng.below(last + 1), 16 * quads);
            };
            Recorder r(*context);
            for (int i = 0; i < 60; ++i) {
                const std::uint64_t quads = 1 + rng.below(16);
                const std::uint64_t from = rng.below(4);
                const BufferView x = view(from, quads);
                const BufferView y = view((from + 1 + rng.below(3)) % 4, quads);
                const auto n = static_cast<std::uint32_t>(4 * quads);
                switch (rng.below(4)) {
                    case 0:
                        EXPECT_OK(r.fill(y, std::bit_cast<std::uint32_t>(0.5F)));
                        break;
                    case 1:
                        EXPECT_OK(r.copy(x, y));
                        break;
                    case 2:
                        EXPECT_OK(r.dispatch(scale(x, y, n, 0.75F)));
                        break;
                    default:
                        EXPECT_OK(r.dispatch(accumulate(x, y, n)));
                }
            }
            CommandList list = need(r.finish());
            for (const Command& command : list.commands())
                barriers[levels ? 1 : 0] += is_barrier(command) ? 1U : 0U;
            EXPECT_OK(context->run(list));
            std::vector<std::uint32_t> words;
            for (const Buffer& buffer : buffers)
                for (const std::uint32_t word :
                     download_words(*context, buffer.range(), 4 * kQuads))
                    words.push_back(word);
            if (!levels) first.push_back(words);
            EXPECT_EQ(words, first[seed - 1]) << seed;
        }
    }
    EXPECT_LT(barriers[1], barriers[0]);
}

}  // namespace
}  // namespace splat::vk
