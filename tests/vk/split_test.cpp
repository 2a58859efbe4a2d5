#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

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

/// They have an estimate that a watchdog would not end, or are refused.
TEST_F(Split, ShadersThatCountGroupsStayWhole) {
    const vk::Device& device = context_->device();
    const double second = 1e9 / estimated_seconds(device.info(), device.kernels(), {.flops = 1e9});
    const double most = std::max(0.5, 4 * device.pace.submit_seconds());
    const CommandList list = record(count_groups(y_.range(), 100, 0.9 * most * second));
    EXPECT_EQ(parts_of(list).size(), 1U);
    CommandList copy = list;
    EXPECT_EQ(run(copy)[0], 100U);
    Recorder recorder(*context_);
    EXPECT_OK(recorder.dispatch(count_groups(y_.range(), 100, 1.1 * most * second)));
    EXPECT_ERROR(recorder.finish(), Code::kInternal,
                 "count_groups (test_count_groups): a submit is estimated at");
}

TEST_F(Split, LongTransfersGiveTheSameResultInParts) {
    ContextDesc desc = context_desc();
    desc.device.max_submit_ns = 1'000'000;
    const auto context = make_context(desc);
    const Pace& pace = context->device().pace;
    std::vector<std::uint32_t> words((5U << 20) / 4 + 4);
    std::iota(words.begin(), words.end(), 1U);
    const Buffer from = upload(*context, words);
    const Buffer to = device_buffer(*context, words.size());
    Recorder recorder(*context);
    EXPECT_OK(recorder.copy(from.range(), to.range()));
    EXPECT_OK(recorder.fill(from.range(), 7));
    CommandList list = need(recorder.finish());
    EXPECT_GE(list.submit_count(), 5U);
    EXPECT_OK(context->run(list));
    if (!pace.watched()) {
        EXPECT_LE(pace.longest_estimate(), pace.submit_seconds());
    }
    EXPECT_EQ(download_words(*context, to.range(), words.size()), words);
    words.assign(words.size(), 7);
    EXPECT_EQ(download_words(*context, from.range(), words.size()), words);
}

/// Data may put all of a dispatch's work into one of its pieces.
TEST_F(Split, UnevenWorkIsBounded) {
    ContextDesc desc = context_desc();
    desc.device.max_submit_ns = 100'000'000;
    desc.device.fake = [](DeviceInfo& info) { info.kind = DeviceKind::kIntegrated; };
    const auto context = make_context(desc);
    const Buffer y = device_buffer(*context, kGroups[0] * kGroups[1]);
    context->device().pace.of("test_slow").most = 1;  // measured as estimated
    for (const double submits : {4.0, 20.0}) {
        Dispatch uneven = slow(y.range(), kGroups, 1, flops_for(*context, submits));
        uneven.most_group.flops = uneven.work.flops / submits * 2;  // two submits take as long
        CommandList list = test::record(*context, {uneven});
        if (submits < 5) {
            EXPECT_LE(list.submit_count(), 5U) << "five submits are not too long for a watchdog";
            continue;
        }
        for (const Piece& part : parts_of(list)) EXPECT_LE(part.groups[0] * part.groups[1], 2U);
        EXPECT_OK(context->run(list));
        EXPECT_GE(list.submit_count(), 204U);
    }
}

}  // namespace
}  // namespace splat::vk
