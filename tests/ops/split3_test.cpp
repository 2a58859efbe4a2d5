#include "ops/split3.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Split3 : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Split3);

TEST_P(Split3, MovesEveryElement) {
    std::uint64_t seed = 10;
    std::vector<Shape> parts_to_test;
    for (const Shape& shape : image_shapes())
        parts_to_test.push_back(
            {shape[0], shape[1],
             static_cast<std::uint32_t>(shape.elements() / (std::uint64_t{shape[0]} * shape[1]))});
    for (const Shape& part : parts_to_test) {
        const OpCall call =
            sample("split3", Json::object(),
                   {normal_tensor({part[0], 3 * part[1], part[2]}, ++seed)}, {part, part, part});
        expect_float64(context(), call, part.text());
    }
}

TEST_P(Split3, MovesStackedParts) {
    for (const Shape& part : {Shape{1, 4, 1}, Shape{2, 8, 15}, Shape{3, 64, 7}}) {
        const OpCall call =
            sample("split3", {{"stacked", true}},
                   {normal_tensor({part[0], 3 * part[1], part[2]}, 3)}, {part, part, part});
        expect_float64(context(), call, part.text());
    }
}

TEST_P(Split3, RejectsBadShapes) {
    const Shape whole{1, 6, 2};
    EXPECT_ERROR(run_op(context(), sample("split3", {{"stacked", true}},
                                          {normal_tensor({1, 18, 2}, 1)}, {whole, whole, whole}))
                     .status,
                 Code::kShape, "multiple of 12 channels");
    const Shape part{1, 2, 2};
    for (const std::uint32_t channels : {2U, 4U, 7U})
        EXPECT_ERROR(
            run_op(context(), sample("split3", Json::object(), {normal_tensor({1, channels, 2}, 1)},
                                     {part, part, part}))
                .status,
            Code::kShape, "multiple of 3");
}

TEST(Split3Reference, GradcheckFloat64) {
    const Shape stacked{2, 4, 3};
    expect_gradcheck(sample("split3", {{"stacked", true}}, {normal_tensor({2, 12, 3}, 1)},
                            {stacked, stacked, stacked}));
    const Shape part{2, 3, 4};
    expect_gradcheck(
        sample("split3", Json::object(), {normal_tensor({2, 9, 4}, 1)}, {part, part, part}));
}

}  // namespace
}  // namespace splat::test
