#include "ops/quads.h"

#include <gtest/gtest.h>

#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "support/shapes.h"

namespace splat::test {
namespace {

/// The layout in words: [ceil(C/4)][N*P] quads, channels beyond C zero.
std::vector<float> expected_quads(const Shape& shape, const std::vector<float>& x) {
    const ops::QuadDims dims = ops::quad_dims(shape, 1).value();
    std::vector<float> quads(dims.bytes() / 4, 0.0F);
    for (std::uint32_t n = 0; n < dims.n; ++n)
        for (std::uint32_t c = 0; c < dims.c; ++c)
            for (std::uint32_t p = 0; p < dims.p; ++p) {
                const std::size_t column = std::size_t{n} * dims.p + p;
                quads[(c / 4 * std::size_t{dims.n} * dims.p + column) * 4 + c % 4] =
                    x[(std::size_t{n} * dims.c + c) * dims.p + p];
            }
    return quads;
}

std::vector<Shape> shapes_to_test() {
    std::vector<Shape> shapes{{7}, {1, 1}, {5, 3}, {257, 129}, {2, 3, 5}, {2, 5, 3, 2, 2}};
    for (const NormShape& s : kNormShapes) shapes.push_back({s.N, s.C, s.H, s.W});
    return shapes;
}

TEST(Quads, PackFollowsTheLayoutAndUnpackInverts) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    std::uint64_t seed = 0;
    for (const Shape& shape : shapes_to_test()) {
        const std::vector<float> x = normal_fill(shape.elements(), ++seed);
        const std::vector<float> expected = expected_quads(shape, x);
        const vk::Buffer in = upload(*context, x);
        const vk::Buffer quads = device_buffer(*context, expected.size());
        const vk::Buffer out = device_buffer(*context, x.size());
        vk::BufferView quad_view = quads.range();
        quad_view.shape = shape;
        vk::Recorder r(*context);
        EXPECT_OK(ops::quads_pack(r, in.view(shape), quad_view));
        EXPECT_OK(ops::quads_unpack(r, quad_view, out.view(shape)));
        vk::CommandList list = std::move(r.finish().value());
        EXPECT_OK(context->run(list));
        const std::string how = reproduce(shape.text());
        EXPECT_TRUE(bit_equal(download(*context, quads.range(), expected.size()), expected,
                              {"quads", how}));
        EXPECT_TRUE(bit_equal(download(*context, out.range(), x.size()), x, {"x", how}));
    }
}

TEST(Quads, MovesBitsUntouched) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    const Shape shape{2, 4};  // NaN, infinities, a denormal, -0
    const std::vector<std::uint32_t> words{0x7F800000, 0xFF800000, 0x00000001, 0x80000000,
                                           0x3F800000, 0x7F7FFFFF, 0x00800000, 0xFFC00001};
    const vk::Buffer in = upload(*context, words);
    const vk::Buffer quads = device_buffer(*context, 8);
    const vk::Buffer out = device_buffer(*context, 8);
    vk::BufferView quad_view = quads.range();
    quad_view.shape = shape;
    vk::Recorder r(*context);
    EXPECT_OK(ops::quads_pack(r, in.view(shape), quad_view));
    EXPECT_OK(ops::quads_unpack(r, quad_view, out.view(shape)));
    vk::CommandList list = std::move(r.finish().value());
    EXPECT_OK(context->run(list));
    EXPECT_EQ(download_words(*context, out.range(), 8), words);
}

/// Every byte, on every channel of a quad: what a correctly rounded division by 255 gives.
TEST(Quads, LevelsAreTheFloatsOfTheHost) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    const Shape shape{2, 5, 7, 37};
    std::vector<float> x;
    std::vector<std::uint32_t> words((shape.elements() + 3) / 4);
    for (std::uint32_t i = 0; i < shape.elements(); ++i) {
        x.push_back(static_cast<float>(i % 256) / 255.0F);
        words[i / 4] |= i % 256 << 8 * (i % 4);
    }
    const std::vector<float> expected = expected_quads(shape, x);
    const vk::Buffer in = upload(*context, words);
    const vk::Buffer quads = device_buffer(*context, expected.size());
    vk::BufferView quad_view = quads.range(), levels = in.range();
    quad_view.shape = levels.shape = shape;
    vk::Recorder r(*context);
    EXPECT_OK(ops::quads_pack_levels(r, levels, quad_view));
    vk::CommandList list = std::move(r.finish().value());
    EXPECT_OK(context->run(list));
    EXPECT_TRUE(bit_equal(download(*context, quads.range(), expected.size()), expected,
                          {"quads", reproduce(shape.text())}));
}

TEST(Quads, RejectsTensorsWithoutChannels) {
    EXPECT_ERROR(ops::quad_dims({5}).status(), Code::kShape, "[5]");
    EXPECT_ERROR(ops::quad_dims(Shape{}).status(), Code::kShape, "[]");
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    const vk::Buffer x = device_buffer(*context, 8);
    const vk::Buffer y = device_buffer(*context, 8);
    vk::Recorder r(*context);
    EXPECT_ERROR(ops::quads_pack(r, x.view(Shape{}), y.view(Shape{})), Code::kShape, "[]");
    EXPECT_TRUE(r.finish().value().empty()) << "nothing is recorded on error";
}

}  // namespace
}  // namespace splat::test
