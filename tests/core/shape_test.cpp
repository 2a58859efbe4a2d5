#include "core/shape.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/checked_math.h"
#include "support/expect_status.h"

namespace splat {
namespace {

Result<Shape> create(const std::vector<std::int64_t>& dims) {
    return Shape::create(dims, "x");
}

TEST(Shape, CountsAndPrints) {
    const Shape shape{2, 3, 128, 1};
    EXPECT_EQ(shape.rank(), 4U);
    EXPECT_EQ(shape.elements(), 768U);
    EXPECT_EQ(shape.text(), "[2, 3, 128, 1]");
    EXPECT_EQ(Shape{}.elements(), 1U);
    EXPECT_EQ(Shape{}.text(), "[]");
    EXPECT_EQ((Shape{2, 3}), create({2, 3}).value());
    EXPECT_FALSE((Shape{2, 3}) == (Shape{3, 2}));
    EXPECT_FALSE((Shape{2, 3}) == (Shape{2, 3, 1}));
}

TEST(Shape, AcceptsUpTo31BitsOfElements) {
    EXPECT_EQ(create({(std::int64_t{1} << 31) - 1}).value().elements(), kMaxElements);
    EXPECT_TRUE(create({46340, 46340}).ok());
    EXPECT_TRUE(create({1, 1, 1, 1, 1, 1, 1, 1}).ok());
    EXPECT_TRUE(create({}).ok());
}

TEST(Shape, RejectsOverflow) {
    const std::int64_t most = std::numeric_limits<std::int64_t>::max();
    const std::vector<std::int64_t> cases[] = {
        {std::int64_t{1} << 31},                         // one too many
        {46341, 46341},                                  // 2^31 + 4633
        {65536, 65536},                                  // 0 in 32 bits
        {std::int64_t{1} << 32, std::int64_t{1} << 32},  // 0 in 64 bits
        {most, most, most, most},
        {1, most},
    };
    for (const auto& dims : cases) {
        const auto shape = create(dims);
        ASSERT_FALSE(shape.ok());
        EXPECT_EQ(shape.status().code(), Code::kInvalidArgument);
        EXPECT_HAS(shape.status().message(), "2^31 - 1");
    }
}

TEST(Shape, NamesWhatIsWrong) {
    EXPECT_HAS(create({4, 0, 2}).status().message(), "x: dims[1] is 0");
    EXPECT_HAS(create({-7}).status().message(), "dims[0] is -7");
    EXPECT_HAS(create({1, 1, 1, 1, 1, 1, 1, 1, 1}).status().message(), "rank is 9");
}

TEST(CheckedMath, FailsInsteadOfWrapping) {
    constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
    EXPECT_EQ(checked_mul(1ULL << 32, 1ULL << 31), 1ULL << 63);
    EXPECT_EQ(checked_mul(1ULL << 32, 1ULL << 32), std::nullopt);
    EXPECT_EQ(checked_add(most, 0), most);
    EXPECT_EQ(checked_add(most, 1), std::nullopt);
}

TEST(CheckedMath, DividesUpWithoutOverflow) {
    constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
    EXPECT_EQ(ceil_div(0, 7), 0U);
    EXPECT_EQ(ceil_div(7, 7), 1U);
    EXPECT_EQ(ceil_div(8, 7), 2U);
    EXPECT_EQ(ceil_div(most, 2), (1ULL << 63));
    EXPECT_EQ(round_up(0, 16), 0U);
    EXPECT_EQ(round_up(17, 16), 32U);
    EXPECT_EQ(round_up(32, 16), 32U);
}

}  // namespace
}  // namespace splat
