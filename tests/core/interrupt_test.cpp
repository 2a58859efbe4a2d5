#include "core/interrupt.h"

#include <gtest/gtest.h>

#include <csignal>
#include <memory>

namespace splat {
namespace {

constexpr const char* kKind = "kind";
constexpr const char* kOther = "other";

TEST(Interrupt, IsFoundByKeyAndKind) {
    Interrupt one, two;
    const std::uint64_t ones = one.count(), twos = two.count();  // counts those before, too
    one.name(0x1000, kKind);
    two.name(0x1010, kKind);
    EXPECT_TRUE(Interrupt::raise(0x1010, kKind));
    EXPECT_EQ(one.count(), ones);
    EXPECT_EQ(two.count(), twos + 1);
    EXPECT_FALSE(Interrupt::raise(0x1010, kOther));
    EXPECT_FALSE(Interrupt::raise(0x1020, kKind));
    EXPECT_FALSE(Interrupt::raise(0, kKind));
    two.raise();
    EXPECT_EQ(two.count(), twos + 2);
}

TEST(Interrupt, IsHiddenByZeroAndByItsEnd) {
    auto one = std::make_unique<Interrupt>();
    one->name(0x2000, kKind);
    one->name(0, nullptr);
    EXPECT_FALSE(Interrupt::raise(0x2000, kKind));
    one->name(0x2000, kKind);
    one.reset();
    EXPECT_FALSE(Interrupt::raise(0x2000, kKind));
    Interrupt next;  // takes the place of the one before
    EXPECT_FALSE(Interrupt::raise(0x2000, kKind));
    next.name(0x2000, kKind);
    EXPECT_TRUE(Interrupt::raise(0x2000, kKind));
}

TEST(Interrupt, IsRaisedBySignalHandlers) {
    Interrupt one;
    one.name(0x3000, kKind);
    const std::uint64_t before_signal = one.count();
    const auto before =
        std::signal(SIGTERM, [](int) { static_cast<void>(Interrupt::raise(0x3000, kKind)); });
    EXPECT_EQ(std::raise(SIGTERM), 0);
    std::signal(SIGTERM, before);
    EXPECT_EQ(one.count(), before_signal + 1);
}

}  // namespace
}  // namespace splat
