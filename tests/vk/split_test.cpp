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

std::vector<Piece> parts_of(const CommandList& list) {
    std::vector<Piece> parts;
    for (const Piece& piece : list.pieces())
        if (list.commands()[piece.command].kind == CommandKind::kDispatch) parts.push_back(piece);
    return parts;
}

TEST_F(Split, LongDispatchGivesTheSameResultInParts) {
    CommandList whole = record(slow(y_.range(), kGroups, 50, 0));
    EXPECT_EQ(parts_of(whole).size(), 1U);
    EXPECT_EQ(whole.submit_count(), 1U);
    const std::vector<std::uint32_t> expected = run(whole);
    for (std::uint32_t i = 0; i < expected.size(); ++i) ASSERT_EQ(expected[i] & 0xFFFFU, i);

    for (const double submits : {1.5, 3.0, 9.9, 100.0, 1000.0}) {
        CommandList list = record(slow(y_.range(), kGroups, 50, flops_for(*context_, submits)));
        const std::vector<Piece> parts = parts_of(list);
        EXPECT_GT(parts.size(), 1U);
        EXPECT_GT(list.submit_count(), 1U);
        const bool by_rows = submits < kGroups[0];  // along the longest axis, else each row too
        if (!context_->device().pace.watched()) {
            EXPECT_EQ(parts.size() > kGroups[0], !by_rows);
        }
        std::vector<int> times(std::size_t{kGroups[0]} * kGroups[1]);
        for (const Piece& part : parts) {
            if (by_rows) {
                EXPECT_EQ(part.groups[1], kGroups[1]);
            }
            for (std::uint32_t y = 0; y < part.groups[1]; ++y)
                for (std::uint32_t x = 0; x < part.groups[0]; ++x)
                    ++times[(part.base[1] + y) * kGroups[0] + part.base[0] + x];
        }
        EXPECT_EQ(times, std::vector<int>(times.size(), 1)) << "each group once";
        EXPECT_EQ(run(list), expected) << submits;
        EXPECT_EQ(run(list), expected) << "second run";
    }
}

TEST_F(Split, PiecesStayWithinOneSubmit) {
    CommandList list = record(slow(y_.range(), kGroups, 1, flops_for(*context_, 10)));
    Pace& pace = context_->device().pace;
    for (const Piece& part : parts_of(list))
        EXPECT_LE(part.seconds * pace.of("test_slow").factor, pace.submit_seconds());
    EXPECT_GE(list.submit_count(), pace.watched() ? 4U : 10U);  // they grow: 1 + 2 + 4 + 8
}

TEST_F(Split, ManyShortDispatchesAreSpreadOverSubmits) {
    Recorder recorder(*context_);
    for (int i = 0; i < 10; ++i)
        EXPECT_OK(recorder.dispatch(slow(y_.range(), kGroups, 50, flops_for(*context_, 0.4))));
    CommandList list = need(recorder.finish());
    EXPECT_EQ(parts_of(list).size(), 10U);
    EXPECT_EQ(list.submit_count(), context_->device().pace.watched() ? 3U : 5U);  // they grow
    CommandList whole = record(slow(y_.range(), kGroups, 50, 0));
    EXPECT_EQ(run(list), run(whole));
}

TEST_F(Split, ShadersThatCountGroupsStayWhole) {
    const CommandList list =
        record(count_groups(y_.range(), 100, flops_for(*context_, 20, "test_count_groups")));
    EXPECT_EQ(parts_of(list).size(), 1U);
    CommandList copy = list;
    EXPECT_EQ(run(copy)[0], 100U);
}

}  // namespace
}  // namespace splat::vk
