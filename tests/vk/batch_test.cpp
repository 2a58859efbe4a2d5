#include "vk/batch.h"

#include <gtest/gtest.h>

#include <cstring>

#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/parsed_json.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

using namespace test;

constexpr std::uint32_t kCount = 64;

/// With memory that the host sees, and without.
class Batches : public testing::TestWithParam<bool> {
  protected:
    Batches() {
        ContextDesc desc = context_desc();
        desc.memory.hide_host = GetParam();
        desc.profile = true;
        context_ = make_context(desc);
        x_ = upload(*context_, std::vector<float>(kCount, 1));
        y_ = upload(*context_, std::vector<float>(kCount, 0));
        z_ = upload(*context_, std::vector<float>(kCount, 0));
        to_y_ = record(*context_, {scale(x_.range(), y_.range(), kCount, 2)});
        to_z_ = record(*context_, {scale(x_.range(), z_.range(), kCount, 3)});
        add_ = record(*context_, {accumulate(x_.range(), y_.range(), kCount)});
        context_->profile()->reset();
    }
    [[nodiscard]] int lists() const {
        return need(parse_json(context_->profile()->json("x"), "profile"))["lists"]["count"];
    }
    Status write(const Buffer& to, float value) {
        const std::vector<float> values(kCount, value);
        return context_->write(to.range(), values.data(), sizeof(float) * kCount);
    }
    void expect(const Buffer& of, float value) {
        EXPECT_EQ(download(*context_, of.range(), kCount), std::vector<float>(kCount, value));
    }

    std::shared_ptr<Context> context_;
    Buffer x_, y_, z_;
    CommandList to_y_, to_z_, add_;
    Batch batch_;
};
INSTANTIATE_TEST_SUITE_P(Memory, Batches, testing::Bool());

TEST_P(Batches, ScopesAreOneListEach) {
    for (const float value : {5.0F, 6.0F}) {
        BatchScope scope(*context_, batch_);
        ASSERT_OK(write(x_, value));
        ASSERT_OK(context_->fill(y_.range(), 0));
        {
            Batch other;
            BatchScope inner(*context_, other);
            ASSERT_OK(context_->run(add_));
            ASSERT_OK(inner.finish());
        }
        ASSERT_OK(context_->run(to_z_));
        ASSERT_OK(scope.finish());
        EXPECT_EQ(lists(), value == 5 ? 1 : 2);
        if (value == 5) continue;
        expect(y_, value);
        expect(z_, 3 * value);
    }
}

TEST_P(Batches, KeepsTheOrderOfWritesAndReads) {
    BatchScope scope(*context_, batch_);
    std::vector<float> seen;
    const auto keep = [&](std::span<const std::byte> bytes) {
        float first = 0;
        std::memcpy(&first, bytes.data(), sizeof first);
        seen.push_back(first);
    };
    ASSERT_OK(write(x_, 5));
    ASSERT_OK(context_->run(to_y_));
    ASSERT_OK(context_->read_later(y_.range(), 4, keep));
    ASSERT_OK(write(x_, 7));
    ASSERT_OK(context_->run(to_z_));
    ASSERT_OK(context_->run(add_));
    ASSERT_OK(context_->read_later(y_.range(), 4, keep));
    EXPECT_TRUE(seen.empty());
    expect(z_, 21);  // runs what is noted
    EXPECT_EQ(seen, (std::vector<float>{10, 17}));
    EXPECT_EQ(lists(), 1);
    ASSERT_OK(scope.finish());
}

/// A transfer larger than the staging buffer, and several that fill it.
TEST_P(Batches, TakesTransfersOfAnySize) {
    constexpr std::size_t kLarge = (9U << 20) / 4;
    const Buffer large = device_buffer(*context_, kLarge);
    BatchScope scope(*context_, batch_);
    for (const float value : {1.0F, 2.0F, 3.0F}) {
        std::vector<float> values(kLarge, value);
        ASSERT_OK(context_->run(to_y_));
        for (const std::size_t count : {kLarge, kLarge / 2, kLarge / 2 + 1})
            ASSERT_OK(context_->write(large.range(), values.data(), count * sizeof(float)));
        float last = 0;
        ASSERT_OK(context_->read_later(
            large.range(), large.bytes(), [&](std::span<const std::byte> bytes) {
                std::memcpy(&last, &bytes[bytes.size() - sizeof last], sizeof last);
            }));
        EXPECT_EQ(last, value);
    }
    ASSERT_OK(scope.finish());
}

TEST_P(Batches, KeepsAsManyListsAsItIsMadeFor) {
    constexpr std::uint32_t kLists = 40;
    Batch batch(kLists);
    std::vector<CommandList> kept;  // so that no other has their address
    for (std::uint32_t i = 0; i < 2 * kLists; ++i) {
        const Noted fill{.kind = CommandKind::kFill, .to = x_.range(), .word = i % kLists};
        kept.push_back(*need(batch.join(*context_, {fill})));
        EXPECT_EQ(&kept[i].commands(), &kept[i < kLists ? i : i - kLists].commands());
    }
}

TEST_P(Batches, DropsListsButNotWrites) {
    std::uint64_t number = 0;
    {
        BatchScope scope(*context_, batch_);
        ASSERT_OK(context_->run(to_y_));
        number = context_->noted();
        ASSERT_OK(write(x_, 9));
        ASSERT_OK(context_->read_later(y_.range(), 4, [](auto) { ADD_FAILURE(); }));
    }
    EXPECT_TRUE(context_->dropped(number));
    EXPECT_FALSE(context_->dropped(number - 1) || context_->dropped(number + 1));
    expect(x_, 9);
    expect(y_, 0);
}

TEST_P(Batches, ListsThatCannotBeJoinedMayBeTriedAgain) {
    auto& make = context_->device().vk.vkCreateDescriptorPool;
    const auto real = make;
    for (const bool fails : {true, false}) {
        BatchScope scope(*context_, batch_);
        ASSERT_OK(context_->run(to_z_));
        if (fails) {
            ASSERT_OK(write(x_, 4));
        }
        ASSERT_OK(context_->run(to_y_));
        make = fails ? [](auto...) { return VK_ERROR_FRAGMENTED_POOL; } : real;
        const Status done = scope.finish();
        make = real;
        if (fails) {
            EXPECT_ERROR(done, Code::kOutOfDeviceMemory, "vkCreateDescriptorPool");
        } else {
            EXPECT_OK(done);
        }
        expect(y_, fails ? 0 : 8);
    }
}

/// A write that is still owed when its buffer is freed goes where nothing else lies.
TEST_P(Batches, OwedWritesDoNotReachOtherBuffers) {
    Buffer freed = device_buffer(*context_, kCount);
    {
        BatchScope scope(*context_, batch_);
        ASSERT_OK(context_->run(to_y_));
        ASSERT_OK(context_->fill(freed.range(), 0));  // so that the write waits for its turn
        ASSERT_OK(write(freed, 6));
    }
    const std::uint64_t at = freed.range().offset;
    const VkBuffer buffer = freed.range().buffer;
    freed = Buffer();
    const Buffer fresh = device_buffer(*context_, kCount);
    EXPECT_FALSE(fresh.range().offset == at && fresh.range().buffer == buffer);
    expect(y_, 0);  // does what is owed
    const Buffer later = device_buffer(*context_, kCount);
    EXPECT_EQ(later.range().offset, at);
}

TEST_P(Batches, MemoryOfNotedListsIsNotReused) {
    Buffer freed = device_buffer(*context_, kCount);
    CommandList list = record(*context_, {scale(x_.range(), freed.range(), kCount, 8)});
    const std::uint64_t at = freed.range().offset;
    const VkBuffer buffer = freed.range().buffer;
    BatchScope scope(*context_, batch_);
    ASSERT_OK(context_->run(list));
    freed = Buffer();
    const Buffer fresh = device_buffer(*context_, kCount);
    EXPECT_FALSE(fresh.range().offset == at && fresh.range().buffer == buffer);
    ASSERT_OK(scope.finish());
    const Buffer later = device_buffer(*context_, kCount);
    EXPECT_EQ(later.range().offset, at);
}

TEST_P(Batches, DealsOutTheTime) {
    double scaling = 0, adding = 0;
    BatchScope scope(*context_, batch_);
    context_->charge = &scaling;
    ASSERT_OK(context_->run(to_y_));
    context_->charge = &adding;
    ASSERT_OK(context_->run(add_));
    ASSERT_OK(scope.finish());
    EXPECT_GT(scaling, 0);
    EXPECT_GT(adding, 0);
}

}  // namespace
}  // namespace splat::vk
