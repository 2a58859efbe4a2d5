#include "ops/strided_copy.h"

#include <gtest/gtest.h>

#include "ref/strided_copy_ref.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

ops::StridedCopyDesc desc_of(const ref::StridedCopy& copy) {
    const auto narrow = [](std::size_t value) { return static_cast<std::uint32_t>(value); };
    return {copy.count,
            narrow(copy.channels),
            {narrow(copy.in_stride), narrow(copy.in_offset)},
            {narrow(copy.out_stride), narrow(copy.out_offset)},
            copy.accumulate};
}

std::size_t floats(std::size_t count, std::size_t stride) {
    return (count * stride + 3) / 4 * 4;
}

/// Against plain loops. The memory between the elements stays unchanged.
void compare(vk::Context& context, const ref::StridedCopy& copy) {
    const std::vector<float> x = normal_fill(floats(copy.count, copy.in_stride), 1);
    std::vector<float> expected = normal_fill(floats(copy.count, copy.out_stride), 2);
    const vk::Buffer in = upload(context, x);
    const vk::Buffer out = upload(context, expected);
    vk::Recorder recorder(context);
    ASSERT_OK(ops::strided_copy(recorder, desc_of(copy), in.range(), out.range()));
    vk::CommandList list = std::move(recorder.finish().value());
    ASSERT_OK(context.run(list));
    ref::strided_copy(copy, x, expected);
    EXPECT_TRUE(
        bit_equal(download(context, out.range(), expected.size()), expected,
                  {"y", reproduce(format("%zu x %zu, strides %zu %zu", copy.count, copy.channels,
                                         copy.in_stride, copy.out_stride))}));
}

TEST(StridedCopy, MatchesPlainLoops) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    for (const bool accumulate : {false, true})
        for (const std::size_t count : {1, 3, 255, 257, 70000}) {
            compare(*context, {count, 3, 3, 0, 12, 0, accumulate});  // means into the packed layout
            compare(*context, {count, 1, 1, 0, 12, 3, accumulate});  // opacities
            compare(*context, {count, 4, 12, 8, 4, 0, accumulate});  // gradient of the rotations
            compare(*context, {count, 3, 4, 0, 3, 0, accumulate});   // RGB of an image
            compare(*context, {count, 27, 28, 0, 27, 0, accumulate});  // bands of degree 2
        }
}

TEST(StridedCopy, OfNothingRecordsNothing) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    const vk::Buffer x = device_buffer(*context, 4);
    const vk::Buffer y = device_buffer(*context, 4);
    vk::Recorder recorder(*context);
    EXPECT_OK(ops::strided_copy(recorder, {}, x.range(), y.range()));
    EXPECT_TRUE(recorder.finish().value().empty());
}

TEST(StridedCopy, RefusesWhatDoesNotFit) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    const vk::Buffer x = device_buffer(*context, 12);
    const vk::Buffer y = device_buffer(*context, 12);
    vk::Recorder recorder(*context);
    const auto copy = [&](const ops::StridedCopyDesc& desc) {
        return ops::strided_copy(recorder, desc, x.range(), y.range());
    };
    EXPECT_ERROR(copy({4, 3, {2, 0}, {3, 0}}), Code::kShape, "stride 2 of x");
    EXPECT_ERROR(copy({4, 3, {3, 0}, {4, 2}}), Code::kShape, "stride 4 of y");
    EXPECT_ERROR(copy({4, 0, {3, 0}, {3, 0}}), Code::kShape, "0 floats");
    EXPECT_ERROR(copy({5, 3, {3, 0}, {3, 0}}), Code::kShape, "x has 48 bytes");
    EXPECT_ERROR(copy({4, 3, {3, 0}, {4, 0}}), Code::kShape, "y has 48 bytes");
    EXPECT_ERROR(copy({1, 1, {1U << 31, 0}, {1, 0}}), Code::kUnsupported, "too long");
    EXPECT_TRUE(recorder.finish().value().empty()) << "nothing is recorded on error";
}

/// An array longer than a binding of the device.
TEST(StridedCopy, LongArraysGoInParts) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    const std::uint64_t limit = context->device().info().limits.max_storage_buffer_bytes;
    if (limit > std::uint64_t{256} << 20)
        GTEST_SKIP() << "bindings of this device hold " << limit << " bytes";
    constexpr std::uint64_t kStride = 48;
    const std::uint64_t count = limit / (kStride * 4) + 700;
    auto packed =
        context->memory().allocate(count * kStride * 4, vk::MemoryKind::kDevice, "packed");
    ASSERT_OK(packed.status());
    const vk::Buffer out = device_buffer(*context, count);
    std::vector<float> values(count);
    for (std::uint64_t i = 0; i < count; ++i) values[i] = static_cast<float>(i);
    const vk::Buffer in = upload(*context, values);
    vk::Recorder recorder(*context);
    ASSERT_OK(ops::strided_copy(recorder, {count, 1, {1, 0}, {kStride, 47}, false}, in.range(),
                                packed.value().range()));
    ASSERT_OK(ops::strided_copy(recorder, {count, 1, {kStride, 47}, {1, 0}, false},
                                packed.value().range(), out.range()));
    vk::CommandList list = std::move(recorder.finish().value());
    ASSERT_OK(context->run(list));
    EXPECT_EQ(download(*context, out.range(), count), values);
}

}  // namespace
}  // namespace splat::test
