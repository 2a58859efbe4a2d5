#include "ops/dropout.h"

#include <gtest/gtest.h>

#include <bit>

#include "core/rng.h"
#include "ops/op_harness.h"
#include "ref/dropout_ref.h"

namespace splat::test {
namespace {

class Dropout : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Dropout);

using Counter = std::array<std::uint32_t, 4>;

HostTensor counter_tensor(const Counter& counter) {
    HostTensor tensor{{4}, {}};
    for (const std::uint32_t word : counter) tensor.values.push_back(std::bit_cast<float>(word));
    return tensor;
}

OpCall dropout_call(const Shape& shape, double p, int stream, const Counter& counter) {
    return sample("dropout", {{"p", p}, {"stream", stream}},
                  {normal_tensor(shape, 1), counter_tensor(counter)}, {shape});
}

TEST_P(Dropout, MatchesFloat64) {
    int stream = 0;
    for (const Shape& shape : image_shapes()) {
        const Counter counter{0xDEADBEEFU, 0x12345678U, 1000U + static_cast<std::uint32_t>(stream),
                              0xFFFFFFFEU};
        const double p = stream % 2 == 0 ? 0.1 : 0.5;
        expect_float64(context(), dropout_call(shape, p, ++stream, counter), shape.text());
    }
}

TEST_P(Dropout, KeepsTheShareAndTheMean) {
    const Shape shape{1, 64, 64, 64};
    OpCall call = dropout_call(shape, 0.1, 0, {1, 2, 3, 0});
    call.grad_outputs.clear();
    std::fill(call.inputs[0].values.begin(), call.inputs[0].values.end(), 1.0F);
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    double sum = 0;
    for (const float value : gpu.outputs[0]) sum += static_cast<double>(value);
    // Five standard deviations of the mean of 2^18 elements: sqrt(p / (1 - p) / 2^18).
    EXPECT_NEAR(sum / static_cast<double>(gpu.outputs[0].size()), 1, 5 * 6.6e-4);
}

TEST_P(Dropout, StreamsAndStepsDiffer) {
    const Shape shape{1, 32, 8, 8};
    const auto mask = [&](int stream, const Counter& counter) {
        OpCall call = dropout_call(shape, 0.5, stream, counter);
        call.grad_outputs.clear();
        return run_op(context(), call).outputs.at(0);
    };
    const auto base = mask(0, {1, 2, 3, 0});
    EXPECT_EQ(base, mask(0, {1, 2, 3, 0}));
    EXPECT_EQ(mask(1, {1, 2, 3, 0}), mask(0, {1, 2, 3, 1})) << "the offset adds to the stream";
    for (const auto& other : {mask(1, {1, 2, 3, 0}), mask(0, {2, 2, 3, 0}), mask(0, {1, 3, 3, 0}),
                              mask(0, {1, 2, 4, 0})})
        EXPECT_NE(base, other);
}

TEST_P(Dropout, RejectsBadArguments) {
    const auto status = [&](double p, int stream, const HostTensor& counter) {
        OpCall call = dropout_call({1, 4}, p, stream, {});
        call.inputs[1] = counter;
        return run_op(context(), call).status;
    };
    const HostTensor counter = counter_tensor({1, 2, 3, 4});
    EXPECT_OK(status(0, 0, counter));
    EXPECT_ERROR(status(1, 0, counter), Code::kInvalidArgument, "p is 1");
    EXPECT_ERROR(status(-0.1, 0, counter), Code::kInvalidArgument, "p is -0.1");
    EXPECT_ERROR(status(0.1, -1, counter), Code::kInvalidArgument, "stream");
    EXPECT_ERROR(status(0.1, 0, normal_tensor({5}, 1)), Code::kShape, "'counter'");
}

/// The known answers of the generator's authors (Random123, kat_vectors).
TEST(DropoutReference, PhiloxGivesTheKnownAnswers) {
    using Words = std::array<std::uint32_t, 4>;
    using Key = std::array<std::uint32_t, 2>;
    const auto expect = [](const Words& counter, const Key& key, const Words& answer) {
        EXPECT_EQ(philox(counter, key), answer);
        EXPECT_EQ(ref::philox(counter, key), answer);
    };
    expect({0, 0, 0, 0}, {0, 0}, {0x6627E8D5U, 0xE169C58DU, 0xBC57AC4CU, 0x9B00DBD8U});
    expect({~0U, ~0U, ~0U, ~0U}, {~0U, ~0U}, {0x408F276DU, 0x41C83B0EU, 0xA20BC7C6U, 0x6D5451FDU});
    expect({0x243F6A88U, 0x85A308D3U, 0x13198A2EU, 0x03707344U}, {0xA4093822U, 0x299F31D0U},
           {0xD16CFE09U, 0x94FDCCEBU, 0x5001E420U, 0x24126EA1U});
}

TEST(DropoutReference, GradcheckFloat64) {
    expect_gradcheck(dropout_call({2, 3, 4}, 0.4, 1, {1, 2, 3, 4}));
}

}  // namespace
}  // namespace splat::test
