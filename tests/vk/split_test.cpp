#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

using namespace test;

class Split : public testing::Test {
  protected:
    void SetUp() override {
        context_ = shared_context();
        y_ = device_buffer(*context_, kGroups[0] * kGroups[1]);
    }

    std::vector<std::uint32_t> run(CommandList& list) {
        EXPECT_OK(context_->fill(y_.range(), 0));
        EXPECT_OK(context_->run(list));
        return download_words(*context_, y_.range(), kGroups[0] * kGroups[1]);
    }

    CommandList record(const Dispatch& dispatch) { return test::record(*context_, {dispatch}); }

    static constexpr Groups kGroups{37, 11, 1};
    Context* context_ = nullptr;
    Buffer y_;
};

std::vector<Command> parts_of(const CommandList& list) {
    std::vector<Command> parts;
    for (const Command& command : list.commands())
        if (command.kind == CommandKind::kDispatch) parts.push_back(command);
    return parts;
}

TEST_F(Split, LongDispatchGivesTheSameResultInParts) {
    CommandList whole = record(slow(y_.range(), kGroups, 50, 0));
    EXPECT_EQ(parts_of(whole).size(), 1U);
    EXPECT_EQ(whole.submit_count(), 1U);
    const std::vector<std::uint32_t> expected = run(whole);
    for (std::uint32_t i = 0; i < expected.size(); ++i) ASSERT_EQ(expected[i] & 0xFFFFU, i);

    for (const double submits : {1.5, 3.0, 9.9, 1000.0}) {
        CommandList list = record(slow(y_.range(), kGroups, 50, flops_for(*context_, submits)));
        const std::vector<Command> parts = parts_of(list);
        EXPECT_GT(parts.size(), 1U);
        EXPECT_LE(parts.size(), kGroups[0]);  // along the longest axis, at least one group each
        EXPECT_GT(list.submit_count(), 1U);
        std::uint32_t next = 0;
        for (const Command& part : parts) {
            EXPECT_EQ(part.base[0], next);
            EXPECT_EQ(part.groups[1], kGroups[1]);
            next += part.groups[0];
        }
        EXPECT_EQ(next, kGroups[0]);
        EXPECT_EQ(run(list), expected) << submits;
        EXPECT_EQ(run(list), expected) << "second run";
    }
}

TEST_F(Split, PiecesStayWithinOneSubmit) {
    CommandList list = record(slow(y_.range(), kGroups, 1, flops_for(*context_, 10)));
    const DeviceInfo& info = context_->device().info();
    for (const Command& part : parts_of(list))
        EXPECT_LE(estimated_seconds(info, context_->device().kernels(), part.work),
                  submit_seconds(info) * 1.2);  // groups do not divide evenly: 37 into 10
    EXPECT_GE(list.submit_count(), 10U);
}

TEST_F(Split, ManyShortDispatchesAreSpreadOverSubmits) {
    Recorder recorder(*context_);
    for (int i = 0; i < 10; ++i)
        EXPECT_OK(recorder.dispatch(slow(y_.range(), kGroups, 50, flops_for(*context_, 0.4))));
    CommandList list = need(recorder.finish());
    EXPECT_EQ(parts_of(list).size(), 10U);
    EXPECT_EQ(list.submit_count(), 5U);
    CommandList whole = record(slow(y_.range(), kGroups, 50, 0));
    EXPECT_EQ(run(list), run(whole));
}

TEST_F(Split, PushDataReachesEveryPart) {
    CommandList whole = record(slow(y_.range(), kGroups, 99, 0));
    CommandList list = record(slow(y_.range(), kGroups, 1, flops_for(*context_, 5)));
    EXPECT_OK(list.set_push(0, SlowParams{kGroups[0], 99}));
    EXPECT_EQ(run(list), run(whole));
}

TEST_F(Split, ShadersThatCountGroupsStayWhole) {
    const CommandList list = record(count_groups(y_.range(), 100, flops_for(*context_, 20)));
    EXPECT_EQ(parts_of(list).size(), 1U);
    CommandList copy = list;
    EXPECT_EQ(run(copy)[0], 100U);
}

}  // namespace
}  // namespace splat::vk
