#include <gtest/gtest.h>

#include <chrono>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/parsed_json.h"
#include "support/require_vulkan.h"
#include "test_shaders.h"
#include "vk/timers.h"

namespace splat::vk {
namespace {

TEST(Profile, SumsUpByOperatorAndShader) {
    Profile profile;
    for (const double ms : {3.0, 1.0, 2.0, 5.0, 4.0})
        profile.add("a", "a_cpu", ms, {10 * ms, 2e7 * ms});
    profile.add("b", "b_plain", 100, {});
    const Json json = need(parse_json(profile.json("a \"device\""), "profile"));
    EXPECT_EQ(json["device"], "a \"device\"");
    ASSERT_EQ(json["ops"].size(), 2U);
    EXPECT_EQ(json["ops"][0]["op"], "b");  // longest first
    const Json& a = json["ops"][1];
    EXPECT_EQ(a["kernel"], "a_cpu");
    EXPECT_EQ(a["count"], 5);
    EXPECT_EQ(a["total_ms"], 15);
    EXPECT_EQ(a["min_ms"], 1);
    EXPECT_EQ(a["median_ms"], 3);
    EXPECT_EQ(a["flops"], 30) << "the mean";
    EXPECT_EQ(a["bytes"], 6e7);
    const std::string table = profile.table("device");
    EXPECT_HAS(table, "a_cpu");
    EXPECT_HAS(table, "20.00") << "GB/s of all dispatches: " << table;
    EXPECT_LT(table.find("b_plain"), table.find("a_cpu"));
    profile.add_list({.submits = 1,
                      .dispatches = 4,
                      .copies = 1,
                      .barriers = 4,
                      .transfer_barriers = 1,
                      .host_barriers = 1,
                      .gaps = 3,
                      .idle_ms = 1.5,
                      .device_ms = 9,
                      .longest_submit_ms = 8});
    profile.add_list({.submits = 2,
                      .dispatches = 2,
                      .copies = 0,
                      .barriers = 3,
                      .host_barriers = 1,
                      .gaps = 1,
                      .idle_ms = 0.25,
                      .device_ms = 1,
                      .longest_submit_ms = 0.5});
    const Json both = parse_json(profile.json("x"), "profile").value();
    EXPECT_EQ(both["idle"], (Json{{"count", 4}, {"total_ms", 1.75}}));
    EXPECT_EQ(both["lists"], (Json{{"count", 2},
                                   {"submits", 3},
                                   {"dispatches", 6},
                                   {"copies", 1},
                                   {"barriers", 7},
                                   {"compute_barriers", 4},
                                   {"transfer_barriers", 1},
                                   {"host_barriers", 2},
                                   {"levels", 5},
                                   {"bytes", 3e8},
                                   {"device_ms", 10},
                                   {"longest_submit_ms", 8}}));
    profile.add_read(16);
    profile.add_write(100);
    profile.add_write(4);
    const Json moved = {{"reads", 1}, {"read_bytes", 16}, {"writes", 2}, {"written_bytes", 104}};
    EXPECT_EQ(parse_json(profile.json("x"), "profile").value()["transfers"], moved);
    EXPECT_HAS(profile.table("x"), "between dispatches");
    EXPECT_HAS(profile.table("x"), "1 reads of 16 bytes, 2 writes of 104");
    profile.reset();
    const Json none = need(parse_json(profile.json("x"), "profile"));
    EXPECT_EQ(none["ops"].size(), 0U);
    EXPECT_EQ(none["idle"]["count"], 0);
    EXPECT_EQ(none["idle"]["total_ms"], 0);
    EXPECT_EQ(none["lists"]["dispatches"], 0);
    EXPECT_EQ(none["transfers"]["written_bytes"], 0);
}

TEST(Profile, CountsTransfersAndTheirBytes) {
    ContextDesc desc = test::context_desc();
    desc.profile = true;
    const auto context = test::make_context(desc);
    const Buffer x = test::device_buffer(*context, 4096);
    std::vector<std::byte> values(4096);
    EXPECT_OK(context->write(x.range(), values.data(), 4096));
    EXPECT_OK(context->read(x.range(), values.data(), 64));
    EXPECT_OK(context->read(x.range(), values.data(), 4096));
    context->unprofiled = true;
    EXPECT_OK(context->read(x.range(), values.data(), 4096));
    EXPECT_OK(context->write(x.range(), values.data(), 4096));
    const Json json = parse_json(context->profile()->json("x"), "profile").value();
    const Json moved = {{"reads", 2}, {"read_bytes", 4160}, {"writes", 1}, {"written_bytes", 4096}};
    EXPECT_EQ(json["transfers"], moved);
}

TEST(Profile, KeepsItsMemoryBounded) {
    Profile profile;
    for (int i = 0; i < 100'000; ++i) profile.add("a", "k", i < 50'000 ? 1.0 : 2.0, {});
    const Json json = need(parse_json(profile.json("x"), "profile"));
    EXPECT_EQ(json["ops"][0]["count"], 100'000);
    EXPECT_EQ(json["ops"][0]["median_ms"], 2);  // median of the latest
    EXPECT_EQ(json["ops"][0]["min_ms"], 1);
}

TEST(Profile, MeasuresEveryDispatchOnTheDevice) {
    ContextDesc desc = test::context_desc();
    desc.profile = true;
    const auto context = test::make_context(desc);
    if (context->device().info().limits.timestamp_ns <= 0)
        SPLAT_SKIP_FOR_DEVICE("this device has no timestamps");
    const Buffer y = test::device_buffer(*context, 4096);
    const double flops = test::flops_for(*context, 3.5);
    Recorder recorder(*context);
    EXPECT_OK(recorder.fill(y.range(), 0));
    EXPECT_OK(recorder.dispatch(test::slow(y.range(), {64, 64, 1}, 2000, flops)));
    CommandList list = need(recorder.finish());
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < 3; ++i) EXPECT_OK(context->run(list));
    const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - begin;
    ASSERT_NE(context->profile(), nullptr);
    const Json json = std::move(parse_json(context->profile()->json("x"), "profile").value());
    ASSERT_EQ(json["ops"].size(), 2U) << json.dump(2);
    const Json& slow = json["ops"][0];
    EXPECT_EQ(slow["op"], "slow");
    EXPECT_EQ(slow["kernel"], "test_slow");
    EXPECT_EQ(slow["count"], 3) << "the parts of a split dispatch count as one";
    EXPECT_DOUBLE_EQ(slow["flops"].get<double>(), flops);
    EXPECT_GT(slow["min_ms"].get<double>(), 0);
    EXPECT_GE(slow["total_ms"].get<double>(), 3 * slow["min_ms"].get<double>());
    EXPECT_EQ(json["ops"][1]["op"], "fill");
    const Json& idle = json["idle"];
    EXPECT_GE(idle["count"], context->device().pace.watched() ? 3 : 3 * 4)
        << "also between the parts of a split dispatch, which it need not be when it was measured";
    EXPECT_GT(idle["total_ms"], 0);
    EXPECT_GE(json["lists"]["longest_submit_ms"].get<double>() * 1.001,
              slow["min_ms"].get<double>() / 20)
        << "no dispatch has more pieces";
    double sum = idle["total_ms"].get<double>();
    for (const Json& op : json["ops"]) sum += op["total_ms"].get<double>();
    EXPECT_LE(sum, wall.count()) << "idle and busy times are parts of the calls";
}

std::vector<std::pair<std::size_t, std::size_t>> spans_of(const std::string& kinds, bool alone) {
    std::vector<Command> commands(kinds.size());
    std::vector<Piece> pieces(kinds.size());
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        pieces[i].command = i;
        commands[i].kind = kinds[i] == '|' ? CommandKind::kBarrier : CommandKind::kDispatch;
    }
    std::vector<std::pair<std::size_t, std::size_t>> found;
    for (const PieceSpan& span : timed_spans(commands, pieces, {{0, 4}, {4, kinds.size()}}, alone))
        found.emplace_back(span.first, span.last);
    return found;
}

TEST(Profile, TimesLevelsOrCommands) {
    using Spans = std::vector<std::pair<std::size_t, std::size_t>>;
    EXPECT_EQ(spans_of("|ab|cd|e", true), (Spans{{1, 2}, {2, 3}, {4, 5}, {5, 6}, {7, 8}}));
    EXPECT_EQ(spans_of("|ab|cd|e", false), (Spans{{1, 3}, {4, 6}, {7, 8}}));
    EXPECT_EQ(spans_of("|abcd||", false), (Spans{{1, 4}, {4, 5}})) << "a submit ends a span";
    EXPECT_EQ(spans_of("|||||", false), Spans{});
}

TEST(Profile, DealsTheTimeOfALevelByEstimates) {
    ContextDesc desc = test::context_desc();
    desc.profile = desc.profile_levels = true;
    const auto context = test::make_context(desc);
    if (context->device().info().limits.timestamp_ns <= 0)
        SPLAT_SKIP_FOR_DEVICE("this device has no timestamps");
    const Buffer x = test::device_buffer(*context, 4096);
    const Buffer y = test::device_buffer(*context, 4096);
    Recorder recorder(*context);
    EXPECT_OK(recorder.dispatch(test::slow(x.range(), {8, 1, 1}, 2000, 3e6)));
    EXPECT_OK(recorder.fill(y.range(), 0));  // may run beside it
    EXPECT_OK(recorder.fill(x.range(), 0));  // may not
    CommandList list = need(recorder.finish());
    EXPECT_OK(context->run(list));
    const Json json = parse_json(context->profile()->json("x"), "profile").value();
    EXPECT_EQ(json["idle"]["count"], 1) << "between two levels";
    EXPECT_EQ(json["lists"]["dispatches"], 1);
    EXPECT_EQ(json["lists"]["copies"], 2);
    EXPECT_EQ(json["lists"]["barriers"], 3) << "before, between, to the host";
    EXPECT_EQ(json["lists"]["transfer_barriers"], 2);
    EXPECT_EQ(json["lists"]["compute_barriers"], 0);
    EXPECT_EQ(json["lists"]["levels"], 2);
    double sum = json["idle"]["total_ms"].get<double>();
    for (const Json& op : json["ops"]) {
        EXPECT_GT(op["min_ms"].get<double>(), 0) << op;
        sum += op["total_ms"].get<double>();
    }
    EXPECT_NEAR(sum, json["lists"]["device_ms"].get<double>(), 1e-3);
}

TEST(Profile, IsAbsentUnlessAskedFor) {
    Context* context = test::shared_context();
    EXPECT_EQ(context->profile(), nullptr);
}

}  // namespace
}  // namespace splat::vk
