#include "io/tensor_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "io/sample_weights.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

template <class T>
std::vector<float> floats(NumberType type, std::vector<T> numbers) {
    std::vector<float> values(numbers.size());
    to_floats(type, std::as_bytes(std::span(numbers)), values.data());
    return values;
}

TEST(TensorFile, ConvertsEveryType) {
    EXPECT_EQ(floats<float>(NumberType::kF32, {1.5F, -0.0F}), (std::vector<float>{1.5F, -0.0F}));
    EXPECT_EQ(floats<double>(NumberType::kF64, {0.1, -1e300}),
              (std::vector<float>{0.1F, -kInfinity}));
    EXPECT_EQ(floats<std::uint16_t>(NumberType::kBf16, {0x3F80, 0xC040}),
              (std::vector<float>{1, -3}));
    EXPECT_EQ(floats<std::int64_t>(NumberType::kI64, {-5, 16777217}),
              (std::vector<float>{-5, 16777216}));
    EXPECT_EQ(floats<std::int32_t>(NumberType::kI32, {-7}), (std::vector<float>{-7}));
    EXPECT_EQ(floats<std::int16_t>(NumberType::kI16, {-300}), (std::vector<float>{-300}));
    EXPECT_EQ(floats<std::int8_t>(NumberType::kI8, {-8}), (std::vector<float>{-8}));
    EXPECT_EQ(floats<std::uint8_t>(NumberType::kU8, {255}), (std::vector<float>{255}));
    EXPECT_EQ(floats<std::uint8_t>(NumberType::kBool, {0, 1, 7}), (std::vector<float>{0, 1, 1}));
    const std::uint8_t big[] = {0x40, 0x49, 0x0F, 0xDB};
    float pi = 0;
    to_floats(NumberType::kF32, std::as_bytes(std::span(big)), &pi, std::endian::big);
    EXPECT_EQ(pi, 3.14159274F);
}

TEST(TensorFile, EveryHalfComesBack) {
    for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
        const auto half = static_cast<std::uint16_t>(bits);
        const float value = floats<std::uint16_t>(NumberType::kF16, {half})[0];
        if (std::isnan(value))
            EXPECT_EQ(to_half(value) & 0x7E00U, 0x7E00U) << bits;
        else
            EXPECT_EQ(to_half(value), half) << bits;
    }
}

TEST(TensorFile, HalvesAreTheNearest) {
    // Between any two neighbours: the middle goes to the even one, all else to the nearer one.
    for (std::uint16_t half = 0; half < 0x7BFF; ++half) {
        const auto next = static_cast<std::uint16_t>(half + 1);
        const std::vector<float> ends = floats<std::uint16_t>(NumberType::kF16, {half, next});
        const float middle = (ends[0] + ends[1]) / 2;
        EXPECT_EQ(to_half(middle), half % 2 == 0 ? half : next) << half;
        EXPECT_EQ(to_half(std::nextafter(middle, 0.0F)), half) << half;
        EXPECT_EQ(to_half(-std::nextafter(middle, kInfinity)), next | 0x8000U) << half;
    }
    EXPECT_EQ(to_half(65519.996F), 0x7BFF);
    EXPECT_EQ(to_half(65520.0F), 0x7C00);
    EXPECT_EQ(to_half(-kInfinity), 0xFC00);
    EXPECT_EQ(to_half(1e-20F), 0);
}

TEST(TensorFile, CountsAndRefusesShapes) {
    const auto count = [](std::vector<std::int64_t> dims) { return count_elements(dims, "x"); };
    EXPECT_EQ(count({}).value(), 1U);
    EXPECT_EQ(count({2, 3, 4}).value(), 24U);
    EXPECT_EQ(count({1LL << 60, 0}).value(), 0U);
    EXPECT_EQ(count({(1LL << 31) - 1}).value(), (1ULL << 31U) - 1);
    EXPECT_ERROR(count({1LL << 31}), Code::kInvalidArgument, "more than 2147483647");
    EXPECT_ERROR(count({1LL << 40, 1LL << 40}), Code::kInvalidArgument, "'x'");
    EXPECT_ERROR(count({2, -1}), Code::kInvalidArgument, "[2, -1]");
    EXPECT_ERROR(count(std::vector<std::int64_t>(9, 1)), Code::kInvalidArgument, "9 dimensions");
}

TEST(TensorFile, NamesAreUnique) {
    NamedTensors tensors = test::sample_tensors();
    EXPECT_EQ(tensors.size(), 3U);
    EXPECT_EQ(tensors.elements(), 7U);
    ASSERT_NE(tensors.find("number"), nullptr);
    EXPECT_EQ(tensors.find("number")->values, (std::vector<float>{7}));
    EXPECT_EQ(tensors.find("nothing"), nullptr);
    EXPECT_ERROR(tensors.add({"number", {}, NumberType::kF32, {1}}), Code::kInvalidArgument,
                 "'number' appears twice");
    EXPECT_ERROR(tensors.add({"more", {2}, NumberType::kF32, {1}}), Code::kInvalidArgument,
                 "1 values, its shape [2] needs 2");
    EXPECT_EQ(tensors.size(), 3U);
}

TEST(TensorFile, FindsWhatIsNotFinite) {
    NamedTensors tensors = test::sample_tensors();
    EXPECT_OK(check_finite(tensors));
    ASSERT_OK(tensors.add({"bad", {3}, NumberType::kF32, {1, 2, -kInfinity}}));
    EXPECT_ERROR(check_finite(tensors), Code::kInvalidArgument, "'bad' holds -inf at element 2");
}

}  // namespace
}  // namespace splat::io
