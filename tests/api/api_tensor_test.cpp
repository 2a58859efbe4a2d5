// Tensors: creation, limits, mapping, description, statistics.
#include <cmath>
#include <limits>
#include <numeric>

#include "api/api_calls.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

splat_tensor_info info_of(splat_tensor tensor) {
    return got(splat_tensor_get_info, tensor);
}

splat_tensor_stats stats_of(const Floats& values) {
    const Tensor tensor =
        upload(shared_device(), {static_cast<std::int64_t>(values.size())}, values);
    return got(splat_tensor_check, tensor);
}

void expect_refused_shape(const Dims& dims, splat_result code, const std::string& part) {
    const splat_tensor_desc desc = tensor_desc(dims, "wide");
    Output<splat_tensor> tensor;
    EXPECT_REFUSED(splat_tensor_create(shared_device(), &desc, tensor.out()), code, part);
    EXPECT_TRUE(tensor.untouched());
    const float value = 1;
    EXPECT_REFUSED(
        splat_tensor_from_host(shared_device(), &desc, &value, sizeof value, nullptr, tensor.out()),
        code, part);
    EXPECT_TRUE(tensor.untouched());
}

TEST(ApiTensor, IsFilledWithZeros) {
    // The second of the pair reuses memory that the first one wrote.
    for (int i = 0; i < 2; ++i) {
        const Tensor tensor = make_tensor(shared_device(), {3, 5, 7});
        EXPECT_EQ(download(tensor), Floats(105, 0.0F));
        const Floats dirt(105, 3.0F);
        write(tensor, dirt);
    }
}

TEST(ApiTensor, TakesAndGivesItsElements) {
    const Floats values = normal_fill(2 * 3 * 17, 1);
    const Tensor tensor = upload(shared_device(), {2, 3, 17}, values);
    EXPECT_EQ(download(tensor), values);
    const Floats others = normal_fill(2 * 3 * 17, 2);
    write(tensor, others);
    EXPECT_EQ(download(tensor), others);
}

TEST(ApiTensor, HoldsEveryTypeBitByBit) {
    for (const splat_dtype dtype : {SPLAT_DTYPE_F32, SPLAT_DTYPE_I32, SPLAT_DTYPE_U32}) {
        const Tensor tensor = make_tensor(shared_device(), {4}, "bits", dtype);
        const std::uint32_t bits[] = {0x80000000U, 0x7FC0DEADU, 0xFFFFFFFFU, 1U};
        EXPECT_DONE(splat_tensor_write(tensor, bits, sizeof bits, nullptr));
        std::uint32_t back[4] = {};
        EXPECT_DONE(splat_tensor_read(tensor, back, sizeof back, nullptr));
        EXPECT_EQ(std::memcmp(bits, back, sizeof bits), 0) << dtype;
        EXPECT_EQ(info_of(tensor).dtype, dtype);
    }
}

TEST(ApiTensor, IsDescribed) {
    const std::string name(100, 'n');
    const Tensor tensor = make_tensor(shared_device(), {2, 3}, name.c_str());
    const splat_tensor_info info = info_of(tensor);
    EXPECT_EQ(info.struct_size, sizeof info);
    EXPECT_EQ(info.rank, 2U);
    EXPECT_EQ(info.dims[0], 2);
    EXPECT_EQ(info.dims[1], 3);
    for (int axis = 2; axis < SPLAT_MAX_RANK; ++axis) EXPECT_EQ(info.dims[axis], 0);
    EXPECT_EQ(info.elements, 6U);
    EXPECT_EQ(info.bytes, 24U);
    EXPECT_EQ(info.mapped, 0U);
    EXPECT_EQ(std::string(info.name), std::string(63, 'n'));
}

TEST(ApiTensor, RanksFromScalarToMost) {
    const Tensor scalar = make_tensor(shared_device(), {});
    EXPECT_EQ(info_of(scalar).elements, 1U);
    EXPECT_EQ(download(scalar), Floats{0});
    const Tensor most = make_tensor(shared_device(), Dims(SPLAT_MAX_RANK, 2));
    EXPECT_EQ(info_of(most).elements, 256U);
    splat_tensor_desc desc = tensor_desc({1});
    desc.rank = SPLAT_MAX_RANK + 1;
    splat_tensor none = nullptr;
    EXPECT_REFUSED(splat_tensor_create(shared_device(), &desc, &none), kArgument, "rank is 9");
}

TEST(ApiTensor, ShapesThatOverflowAreRefused) {
    for (const Dims& dims : {Dims{std::int64_t{1} << 31}, Dims{1 << 16, 1 << 15},
                             Dims{INT64_MAX, INT64_MAX}, Dims{INT64_MAX}, Dims{3, 1 << 30},
                             Dims(8, 1 << 30), Dims{std::int64_t{1} << 32, 1 << 30, 1, 1, 4}})
        expect_refused_shape(dims, kArgument, "2^31");
    for (const std::int64_t dim : {std::int64_t{0}, std::int64_t{-1}, INT64_MIN})
        expect_refused_shape({4, dim}, kArgument, "dims[1]");
}

TEST(ApiTensor, MoreThanOneBindingIsUnsupported) {
    const auto device = got(splat_device_get_info, shared_device());
    const auto most = static_cast<std::int64_t>(device.max_storage_buffer_bytes / 4);
    if (most >= INT32_MAX) GTEST_SKIP() << "the device binds more than any tensor may have";
    expect_refused_shape({most + 1}, kUnsupported, std::to_string(device.max_storage_buffer_bytes));
    expect_refused_shape({2, most}, kUnsupported, "wide");
    expect_refused_shape({INT32_MAX}, kUnsupported, "split");
}

TEST(ApiTensorMap, ShowsAndTakesTheContents) {
    const Tensor tensor = upload(shared_device(), {3}, {1, 2, 3});
    void* pointer = nullptr;
    std::size_t bytes = 0;
    ASSERT_DONE(splat_tensor_map(tensor, SPLAT_ACCESS_READ_WRITE, &pointer, &bytes));
    EXPECT_EQ(bytes, 12U);
    EXPECT_EQ(info_of(tensor).mapped, 1U);
    auto* const values = static_cast<float*>(pointer);
    EXPECT_EQ(Floats(values, values + 3), (Floats{1, 2, 3}));
    values[1] = 5;
    ASSERT_DONE(splat_tensor_unmap(tensor));
    EXPECT_EQ(info_of(tensor).mapped, 0U);
    EXPECT_EQ(download(tensor), (Floats{1, 5, 3}));
    const float written[] = {7, 8, 9};
    std::memcpy(mapped(tensor, SPLAT_ACCESS_WRITE), written, sizeof written);
    ASSERT_DONE(splat_tensor_unmap(tensor));
    EXPECT_EQ(download(tensor), (Floats{7, 8, 9}));
}

TEST(ApiTensorMap, KeepsOthersAwayUntilUnmap) {
    const Tensor tensor = upload(shared_device(), {3}, {1, 2, 3}, "mine");
    Output<void*> again;
    Output<std::size_t> bytes;
    EXPECT_REFUSED(splat_tensor_unmap(tensor), kState, "not mapped");
    mapped(tensor, SPLAT_ACCESS_READ);
    EXPECT_REFUSED(splat_tensor_map(tensor, SPLAT_ACCESS_READ, again.out(), bytes.out()), kState,
                   "mine");
    float values[3] = {4, 5, 6};
    EXPECT_REFUSED(splat_tensor_write(tensor, values, sizeof values, nullptr), kState, "unmap");
    EXPECT_REFUSED(splat_tensor_read(tensor, values, sizeof values, nullptr), kState, "unmap");
    Output<splat_tensor_stats> stats;
    stats.set_struct_size(sizeof(splat_tensor_stats));
    EXPECT_REFUSED(splat_tensor_check(tensor, stats.out()), kState, "unmap");
    EXPECT_TRUE(again.untouched() && bytes.untouched() && stats.untouched());
    EXPECT_EQ(values[0], 4.0F);
    ASSERT_DONE(splat_tensor_unmap(tensor));
    EXPECT_EQ(download(tensor), (Floats{1, 2, 3}));
    EXPECT_REFUSED(splat_tensor_unmap(tensor), kState, "not mapped");
}

TEST(ApiTensorMap, EndsWithTheTensor) {
    Tensor tensor = make_tensor(shared_device(), {3});
    mapped(tensor, SPLAT_ACCESS_READ);
    const splat_tensor stale = tensor.destroy();
    EXPECT_REFUSED(splat_tensor_unmap(stale), kHandle, "tensor");
}

TEST(ApiTensorCheck, CountsAndMeasures) {
    Floats values = normal_fill(40000, 3, 10, 2);
    double sum = 0;
    float least = kInf;
    float most = -kInf;
    for (const float value : values) {
        sum += static_cast<double>(value);
        least = std::min(least, value);
        most = std::max(most, value);
    }
    const double mean = sum / 40000;
    values.insert(values.begin() + 7, {kNan, -kInf});
    values.insert(values.end() - 5, {kInf, kNan, kInf});
    const splat_tensor_stats stats = stats_of(values);
    EXPECT_EQ(stats.nan_count, 2U);
    EXPECT_EQ(stats.inf_count, 3U);
    EXPECT_EQ(stats.min, static_cast<double>(least));
    EXPECT_EQ(stats.max, static_cast<double>(most));
    EXPECT_NEAR(stats.mean, mean, 2e-6 * static_cast<double>(most));
    EXPECT_EQ(stats.reserved, 0U);
    EXPECT_EQ(stats.struct_size, sizeof stats);
}

TEST(ApiTensorCheck, WithoutFiniteElements) {
    const splat_tensor_stats stats = stats_of(Floats(33, kNan));
    EXPECT_EQ(stats.nan_count, 33U);
    EXPECT_EQ(stats.inf_count, 0U);
    EXPECT_EQ(stats.min, static_cast<double>(kInf));
    EXPECT_EQ(stats.max, -static_cast<double>(kInf));
    EXPECT_EQ(stats.mean, 0.0);
    EXPECT_EQ(stats_of({kInf, -kInf, kNan}).inf_count, 2U);
}

TEST(ApiTensorCheck, ExtremesAreExact) {
    const float tiny = 1.1754944e-38F;
    const float huge = std::numeric_limits<float>::max();
    const splat_tensor_stats stats = stats_of({tiny, -huge, 0.0F, huge});
    EXPECT_EQ(stats.min, -static_cast<double>(huge));
    EXPECT_EQ(stats.max, static_cast<double>(huge));
    EXPECT_EQ(stats.nan_count + stats.inf_count, 0U);
    const splat_tensor_stats one = stats_of({tiny});
    EXPECT_EQ(one.min, static_cast<double>(tiny));
    EXPECT_EQ(one.max, static_cast<double>(tiny));
}

TEST(ApiTensorCheck, TakesFloatsOnly) {
    const Tensor tensor = make_tensor(shared_device(), {3}, "whole", SPLAT_DTYPE_I32);
    Output<splat_tensor_stats> stats;
    stats.set_struct_size(sizeof(splat_tensor_stats));
    EXPECT_REFUSED(splat_tensor_check(tensor, stats.out()), kArgument, "whole");
    EXPECT_TRUE(stats.untouched());
}

}  // namespace
}  // namespace splat::test
