#include <gtest/gtest.h>

#include <chrono>

#include "core/json.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
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
    const Json json = std::move(parse_json(profile.json("a \"device\""), "profile").value());
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
    EXPECT_NE(table.find("a_cpu"), std::string::npos);
    EXPECT_NE(table.find("20.00"), std::string::npos) << "GB/s of all dispatches: " << table;
    EXPECT_LT(table.find("b_plain"), table.find("a_cpu"));
    profile.add_idle(1.5, 3);
    profile.add_idle(0.25, 1);
    const Json idle = parse_json(profile.json("x"), "profile").value()["idle"];
    EXPECT_EQ(idle["count"], 4);
    EXPECT_EQ(idle["total_ms"], 1.75);
    EXPECT_NE(profile.table("x").find("between dispatches"), std::string::npos);
    profile.reset();
    const Json none = std::move(parse_json(profile.json("x"), "profile").value());
    EXPECT_EQ(none["ops"].size(), 0U);
    EXPECT_EQ(none["idle"]["count"], 0);
    EXPECT_EQ(none["idle"]["total_ms"], 0);
}

TEST(Profile, KeepsItsMemoryBounded) {
    Profile profile;
    for (int i = 0; i < 100'000; ++i) profile.add("a", "k", i < 50'000 ? 1.0 : 2.0, {});
    const Json json = std::move(parse_json(profile.json("x"), "profile").value());
    EXPECT_EQ(json["ops"][0]["count"], 100'000);
    EXPECT_EQ(json["ops"][0]["median_ms"], 2);  // of the latest
    EXPECT_EQ(json["ops"][0]["min_ms"], 1);
}

TEST(Profile, MeasuresEveryDispatchOnTheDevice) {
    ContextDesc desc = test::context_desc();
    desc.profile = true;
    const auto context = test::make_context(desc);
    ASSERT_NE(context, nullptr);
    if (context->device().info().limits.timestamp_ns <= 0)
        SPLAT_SKIP_FOR_DEVICE("this device has no timestamps");
    const Buffer y = test::device_buffer(*context, 4096);
    const double flops = test::flops_for(*context, 3.5);
    Recorder recorder(*context);
    EXPECT_OK(recorder.fill(y.range(), 0));
    EXPECT_OK(recorder.dispatch(test::slow(y.range(), {64, 64, 1}, 2000, flops)));
    CommandList list = std::move(recorder.finish().value());
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
    EXPECT_GE(idle["count"], 3 * 4) << "also between the parts of a split dispatch";
    EXPECT_GT(idle["total_ms"], 0);
    double sum = idle["total_ms"].get<double>();
    for (const Json& op : json["ops"]) sum += op["total_ms"].get<double>();
    EXPECT_LE(sum, wall.count()) << "idle and busy times are parts of the calls";
}

TEST(Profile, IsAbsentUnlessAskedFor) {
    Context* context = test::shared_context();
    ASSERT_NE(context, nullptr);
    EXPECT_EQ(context->profile(), nullptr);
}

}  // namespace
}  // namespace splat::vk
