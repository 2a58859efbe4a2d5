#include "run/group.h"

#include <gtest/gtest.h>

#include "run/thread_group.h"
#include "support/expect_status.h"

namespace splat::run {
namespace {

GroupCalls some_calls(std::uint32_t rank, std::uint32_t count) {
    GroupCalls calls;
    calls.rank = rank;
    calls.count = count;
    calls.send_receive = [](void*, std::uint32_t, const void*, void*, std::uint64_t) { return 5; };
    calls.broadcast = [](void*, std::uint32_t, void*, std::uint64_t) { return 0; };
    calls.barrier = [](void*) { return 0; };
    return calls;
}

TEST(Group, CountsAreChecked) {
    EXPECT_OK(Group::check(some_calls(0, 1)));
    EXPECT_OK(Group::check(some_calls(4095, 4096)));
    for (const std::uint32_t count : {0U, 3U, 6U, 8192U})
        EXPECT_ERROR(Group::check(some_calls(0, count)), Code::kInvalidArgument, "power of two");
    EXPECT_ERROR(Group::check(some_calls(4, 4)), Code::kInvalidArgument, "rank 4 of 4");
    GroupCalls none = some_calls(0, 2);
    none.barrier = nullptr;
    EXPECT_ERROR(Group::check(none), Code::kInvalidArgument, "must not be NULL");
}

TEST(Group, RanksGatherAndTell) {
    for (const std::uint32_t count : {1U, 2U, 4U, 8U}) {
        ThreadGroup threads(count);
        threads.run([&](const GroupCalls& calls) {
            Group group(calls);
            const std::uint32_t mine = 100 + group.rank();
            std::vector<std::uint32_t> all(count);
            EXPECT_OK(group.gather(std::as_bytes(std::span(&mine, 1)),
                                   std::as_writable_bytes(std::span(all))));
            for (std::uint32_t rank = 0; rank < count; ++rank) EXPECT_EQ(all[rank], 100 + rank);
            std::string text = group.leads() ? "from rank 0" : "";
            EXPECT_OK(group.broadcast(text));
            EXPECT_EQ(text, "from rank 0");
            EXPECT_OK(group.barrier());
            EXPECT_OK(group.agree({}));
            if (count == 1) return;
            const bool fails = group.rank() > 0;
            EXPECT_ERROR(group.agree(fails ? damaged("no %s", "file") : Status()), Code::kFormat,
                         "rank 1: no file");
        });
    }
}

TEST(Group, StaysFailed) {
    Group group(some_calls(0, 2));
    std::array<std::byte, 1> byte = {};
    EXPECT_ERROR(group.exchange(1, byte, byte), Code::kIo,
                 "send_receive with rank 1 failed on rank 0 of 2 with 5");
    EXPECT_ERROR(group.barrier(), Code::kIo, "send_receive with rank 1");
}

TEST(Group, ARankThatLeavesEndsTheOthers) {
    ThreadGroup threads(2);
    threads.run([&](const GroupCalls& calls) {
        Group group(calls);
        if (group.leads()) return threads.leave();
        EXPECT_ERROR(group.barrier(), Code::kIo, "a thread is gone");
    });
}

}  // namespace
}  // namespace splat::run
