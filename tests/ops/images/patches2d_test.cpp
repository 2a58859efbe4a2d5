#include "ops/images/patches2d.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Patches2d : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Patches2d);

/// Patches of an image of `c` channels, from the image or, if `up`, back to it.
struct PatchesCase {
    std::uint32_t n, c, rows, columns, size;
    bool up;

    [[nodiscard]] Shape image() const { return {n, c, rows * size, columns * size}; }
    [[nodiscard]] Shape patches() const { return {n, c * size * size, rows, columns}; }
    [[nodiscard]] OpCall call(std::uint64_t seed) const {
        return sample("patches2d", {{"size", size}, {"up", up}},
                      {normal_tensor(up ? patches() : image(), seed)}, {up ? image() : patches()});
    }
};

TEST_P(Patches2d, MatchesFloat64) {
    const std::uint32_t shapes[][5] = {
        {1, 1, 1, 1, 1},  {1, 1, 1, 1, 2},   {2, 3, 2, 5, 2},  {1, 4, 3, 1, 2},
        {1, 5, 1, 7, 3},  {3, 2, 5, 3, 3},   {2, 7, 3, 3, 5},  {1, 3, 9, 11, 14},
        {1, 3, 30, 4, 7}, {1, 64, 15, 9, 2}, {2, 9, 1, 65, 2}, {1, 130, 2, 3, 1},
        {1, 1, 2, 2, 31}, {1, 33, 17, 3, 4}, {2, 6, 4, 4, 16}, {1, 2, 1, 1, 257},
    };
    std::uint64_t seed = 10;
    for (const auto& s : shapes)
        for (const bool up : {false, true}) {
            const OpCall call = PatchesCase{s[0], s[1], s[2], s[3], s[4], up}.call(++seed);
            expect_exact(context(), call, call.inputs[0].shape.text() + (up ? " up" : ""), false);
        }
}

/// An image of 2 x 4 in patches of 2: each has its pixels row by row, and the second channel behind the first.
TEST_P(Patches2d, HasTheOrderOfTheDefinition) {
    const OpResult gpu =
        run_op(context(),
               sample("patches2d", {{"size", 2}},
                      {{{1, 2, 2, 4}, {0, 1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 13, 14, 15, 16, 17}}},
                      std::vector<HostTensor>{}));
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0],
              (std::vector<float>{0, 2, 1, 3, 4, 6, 5, 7, 10, 12, 11, 13, 14, 16, 15, 17}));
}

TEST_P(Patches2d, RejectsBadShapes) {
    const auto status = [&](const Shape& x, const Json& attributes) {
        return run_op(context(), sample("patches2d", attributes, {normal_tensor(x, 1)},
                                        std::vector<HostTensor>{}))
            .status;
    };
    EXPECT_OK(status({1, 1, 2, 4}, Json::object()));
    EXPECT_ERROR(status({1, 1, 3, 4}, Json::object()), Code::kShape, "3 x 4");
    EXPECT_ERROR(status({1, 1, 4, 3}, {{"size", 2}}), Code::kShape, "patch of 2");
    EXPECT_ERROR(status({1, 1, 4}, Json::object()), Code::kShape, "'x'");
    EXPECT_ERROR(status({1, 6, 1, 1}, {{"up", true}}), Code::kShape, "6 channels");
    EXPECT_ERROR(status({1, 1, 2, 2}, {{"size", 0}}), Code::kInvalidArgument, "size is 0");
    EXPECT_ERROR(status({1, 1, 2, 2}, {{"size", -1}}), Code::kInvalidArgument, "size is -1");
    EXPECT_ERROR(status({1, 1, 2, 2}, {{"size", 1025}}), Code::kInvalidArgument, "1025");
}

TEST(Patches2dCheck, RefusesResultsBeyond31Bits) {
    EXPECT_OK(ops::patches2d_check({1, 4, 16384, 16384, 2}));
    EXPECT_ERROR(ops::patches2d_check({3, 4, 16384, 16384, 2}), Code::kUnsupported, "2^31");
    EXPECT_ERROR(ops::patches2d_check({1, 1, 32768, 32768, 1}), Code::kUnsupported, "2^31");
    EXPECT_ERROR(ops::patches2d_check({~0U, ~0U, 1024, 1024, 1024}), Code::kUnsupported, "2^31");
}

TEST(Patches2dReference, GradcheckFloat64) {
    for (const bool up : {false, true}) expect_gradcheck(PatchesCase{1, 2, 2, 1, 2, up}.call(1));
}

}  // namespace
}  // namespace splat::test
