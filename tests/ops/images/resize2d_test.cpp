#include "ops/images/resize2d.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Resize2d : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Resize2d);

struct ResizeCase {
    Shape x;
    std::uint32_t height;
    std::uint32_t width;
    int filter = 0;
    bool antialias = false;
    double scale_y = 0;
    double scale_x = 0;

    [[nodiscard]] Json attributes() const {
        return {{"height", height},       {"width", width},     {"filter", filter},
                {"antialias", antialias}, {"scale_y", scale_y}, {"scale_x", scale_x}};
    }
    [[nodiscard]] OpCall call(std::uint64_t seed) const {
        return sample("resize2d", attributes(), {normal_tensor(x, seed)},
                      {Shape{x[0], x[1], height, width}});
    }
    [[nodiscard]] std::string text() const {
        return x.text() + format(" to %u x %u by %g %g", height, width, scale_y, scale_x) +
               (filter == 1 ? " cubic" : "") + (antialias ? " antialias" : "");
    }
};

TEST_P(Resize2d, MatchesFloat64) {
    std::vector<ResizeCase> cases = {
        {{1, 1, 1, 1}, 1, 1},   {{1, 1, 1, 1}, 3, 5},    {{2, 3, 5, 7}, 5, 7},
        {{2, 3, 5, 7}, 10, 14}, {{1, 6, 9, 4}, 4, 9},    {{3, 5, 2, 33}, 5, 11},
        {{1, 4, 4, 3}, 2, 2},  {{1, 7, 31, 29}, 30, 5}, {{1, 2, 3, 65}, 3, 64},
        {{2, 9, 8, 2}, 7, 2},   {{1, 33, 4, 5}, 37, 3},  {{1, 3, 37, 37}, 30, 40},
        {{1, 1, 2, 3}, 67, 1},
    };
    cases.push_back({{1, 5, 7, 6}, 9, 4, 0, false, 9.1 / 7, 4.1 / 6});
    cases.push_back({{1, 5, 7, 6}, 9, 6, 0, false, 0, 6.1 / 6});
    cases.push_back({{1, 5, 7, 6}, 3, 13, 0, false, 0.5, 13.9 / 6});
    std::uint64_t seed = 10;
    for (ResizeCase c : cases)
        for (const bool antialias : {false, true})
            for (c.filter = 0; c.filter < 2; ++c.filter) {
                c.antialias = antialias;
                expect_float64(context(), c.call(++seed), c.text());
            }
}

/// Rows of torch.nn.functional.interpolate in float64, align_corners = False, of PyTorch 2.
TEST_P(Resize2d, HasTheValuesOfPyTorch) {
    struct {
        ResizeCase how;
        std::vector<double> y;
    } cases[] = {
        {{{}, 1, 8}, {1, 1.4375, 2.125, 3.375, 5.25, 7.75, 5.1875, 3}},
        {{{}, 1, 8, 1},
         {0.907165527, 1.26831055, 2.12957764, 3.02252197, 5.64276123, 8.01275635, 5.4720459,
          2.53582764}},
        {{{}, 1, 3, 1}, {1.2037037, 4, 4.7962963}},
        {{{}, 1, 3, 0, true}, {1.42857143, 4.44444444, 5.14285714}},
        {{{}, 1, 3, 1, true}, {1.23076923, 4.64186047, 5.26153846}},
        {{{}, 1, 8, 1, false, 0, 1.7},
         {0.902624415, 1.233017, 1.93574445, 2.80040836, 4.72934689, 7.64673443, 6.92306127,
          3.37965601}},
        {{{}, 1, 8, 0, true, 0, 1.7},
         {1, 1.38235294, 1.97058824, 3.11764706, 4.58823529, 6.94117647, 6.38235294, 3.44117647}},
    };
    for (const auto& c : cases) {
        const OpResult gpu =
            run_op(context(), sample("resize2d", c.how.attributes(),
                                     {{{1, 1, 1, 5}, {1, 2, 4, 8, 3}}}, std::vector<HostTensor>{}));
        ASSERT_OK(gpu.status);
        for (std::size_t i = 0; i < c.y.size(); ++i)
            EXPECT_NEAR(gpu.outputs[0][i], c.y[i], 2e-6) << c.how.text() << " " << i;
    }
}

/// The coordinates of a wide image keep the digits that weights need.
TEST_P(Resize2d, KeepsDigitsFarFromTheEdge) {
    const ResizeCase c{{1, 1, 1, 20011}, 1, 30013};
    OpCall call = c.call(1);
    call.grad_outputs.clear();
    for (std::size_t i = 0; i < call.inputs[0].values.size(); ++i)
        call.inputs[0].values[i] = i % 2 == 0 ? 1.0F : -1.0F;
    expect_float64(context(), call, c.text());
}

TEST_P(Resize2d, RejectsBadArguments) {
    const auto status = [&](const Shape& x, const Json& attributes) {
        return run_op(context(), sample("resize2d", attributes, {normal_tensor(x, 1)},
                                        std::vector<HostTensor>{}))
            .status;
    };
    const auto with = [](const char* name, const Json& value) {
        Json attributes = {{"width", 4}, {"height", 4}};
        attributes[name] = value;
        return attributes;
    };
    EXPECT_OK(status({1, 1, 2, 3}, with("scale_x", 1.3)));
    EXPECT_ERROR(status({1, 2, 3}, with("filter", 0)), Code::kShape, "'x'");
    EXPECT_ERROR(status({1, 1, 2, 3}, {{"width", 4}}), Code::kInvalidArgument, "height is 0");
    EXPECT_ERROR(status({1, 1, 2, 3}, with("width", -1)), Code::kInvalidArgument, "width is -1");
    EXPECT_ERROR(status({1, 1, 2, 3}, with("width", 1 << 21)), Code::kInvalidArgument, "width");
    EXPECT_ERROR(status({1, 1, 2, 3}, with("filter", 2)), Code::kInvalidArgument, "filter is 2");
    EXPECT_ERROR(status({1, 1, 2, 3}, with("scale_x", 1.9)), Code::kInvalidArgument, "3 columns");
    EXPECT_ERROR(status({1, 1, 2, 3}, with("scale_y", -2)), Code::kInvalidArgument, "-2");
    EXPECT_ERROR(status({1, 1, 1, 3}, with("height", 1025)), Code::kUnsupported, "1024");
}

TEST(Resize2dCheck, RefusesWhatLoopsAndIndicesCannotHold) {
    EXPECT_OK(ops::resize2d_check({1, 4, {8192, 16384}, {8192, 16384}}));
    EXPECT_ERROR(ops::resize2d_check({2, 4, {8192, 16384}, {8192, 32768}}), Code::kUnsupported,
                 "2^31");
    EXPECT_ERROR(ops::resize2d_check({~0U, ~0U, {2, 2}, {2, 2}}), Code::kUnsupported, "2^31");
    EXPECT_ERROR(ops::resize2d_check({1, 1, {4000, 2}, {2, 2}}), Code::kUnsupported, "factor");
    EXPECT_ERROR(ops::resize2d_check({1, 1, {1 << 21, 1 << 21}, {1, 1}}), Code::kUnsupported,
                 "at most");
}

TEST(Resize2dReference, GradcheckFloat64) {
    for (const bool antialias : {false, true})
        for (const int filter : {0, 1}) {
            expect_gradcheck(ResizeCase{{1, 2, 3, 4}, 5, 2, filter, antialias}.call(1));
            expect_gradcheck(ResizeCase{{1, 1, 2, 3}, 2, 4, filter, antialias, 0, 4.1 / 3}.call(2));
        }
}

}  // namespace
}  // namespace splat::test
