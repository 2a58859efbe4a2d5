#include "ops/images/resample2d.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "support/golden_file.h"
#include "support/shapes.h"

namespace splat::test {
namespace {

class Resample2d : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Resample2d);

/// `small` is the shape of the smaller image; a filter of no taps is the default, the box.
struct ResampleCase {
    Shape small;
    bool up;
    std::vector<float> filter;

    [[nodiscard]] Shape large() const { return {small[0], small[1], 2 * small[2], 2 * small[3]}; }
    [[nodiscard]] OpCall call(std::uint64_t seed) const {
        return sample("resample2d", {{up ? "up" : "down", true}},
                      {normal_tensor(up ? small : large(), seed),
                       {Shape{static_cast<std::uint32_t>(filter.size())}, filter}},
                      {up ? large() : small});
    }
    [[nodiscard]] std::string text() const {
        return small.text() + (up ? " up" : " down") + " taps " + std::to_string(filter.size());
    }
};

/// Images of kNormShapes up to 64 pixels, with alternating filters.
std::vector<ResampleCase> resample_cases(bool up) {
    const std::vector<float> filters[] = {
        {}, {1, 3, 3, 1}, {1, 1}, {0.5F, -1, 2, 4, -1, 0.25F}, {1, 2}};
    std::vector<ResampleCase> cases = {{{1, 1, 1, 1}, up, {}}};
    for (const NormShape& s : kNormShapes)
        if (s.elements() <= 16384)
            cases.push_back({{s.N, s.C, s.H, s.W}, up, filters[cases.size() % 5]});
    EXPECT_GE(cases.size(), 24U);
    return cases;
}

TEST_P(Resample2d, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const bool up : {false, true})
        for (const ResampleCase& c : resample_cases(up)) {
            expect_float64(context(), c.call(++seed), c.text());
        }
}

/// Up with the box, each pixel is four; its gradient and the mean of four are exact sums.
TEST_P(Resample2d, IntegersAreExact) {
    std::uint64_t seed = 300;
    for (const bool up : {false, true})
        for (ResampleCase c : resample_cases(up)) {
            c.filter = {1, 1};
            seed += 3;
            OpCall call = with_integers(c.call(seed), seed);
            call.inputs[1].values = c.filter;
            // A ninth of the integers is 0.
            expect_exact(context(), call, c.text(), c.small.elements() < 10);
        }
}

TEST_P(Resample2d, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("conv", [&](const Golden& golden) {
        std::vector<std::string> names = golden.cases("x");
        std::erase_if(names,
                      [&](const std::string& name) { return golden.has(name + ".p.weight"); });
        golden.expect_cases(names, {"c0up", "c0dn"});
        for (const std::string& name : names) {
            const HostTensor x = golden_tensor(golden.npz, name + ".x");
            const HostTensor grad_y = golden_tensor(golden.npz, name + ".g");
            const bool up = grad_y.shape[2] > x.shape[2];
            const OpResult gpu =
                run_op(context(), sample("resample2d", {{up ? "up" : "down", true}}, {x, {}},
                                         std::vector<HostTensor>{grad_y}));
            ASSERT_OK(gpu.status);
            const std::string how = reproduce(golden.name);
            EXPECT_TRUE(close(gpu.outputs[0], golden.doubles(name + ".y64"), kGoldenLayer,
                              kGoldenLayer, {name + " y", how}));
            EXPECT_TRUE(close(gpu.grad_inputs[0], golden.doubles(name + ".d_x64"), kGoldenLayer,
                              kGoldenLayer, {name + " grad_x", how}));
        }
    });
}

TEST_P(Resample2d, RejectsBadShapes) {
    const auto status = [&](const Shape& x, const Json& attributes,
                            const std::vector<float>& filter) {
        const Shape taps{static_cast<std::uint32_t>(filter.size())};
        return run_op(context(),
                      sample("resample2d", attributes, {normal_tensor(x, 1), {taps, filter}},
                             std::vector<HostTensor>{}))
            .status;
    };
    const Json down = {{"down", true}};
    EXPECT_OK(status({1, 1, 2, 2}, down, {}));
    EXPECT_ERROR(status({1, 1, 3, 2}, down, {}), Code::kShape, "3 x 2");
    EXPECT_ERROR(status({1, 1, 2, 5}, down, {}), Code::kShape, "2 x 5");
    EXPECT_OK(status({1, 1, 3, 5}, {{"up", true}}, {}));
    EXPECT_ERROR(status({1, 2, 2}, down, {}), Code::kShape, "'x'");
    EXPECT_ERROR(status({1, 1, 2, 2}, Json::object(), {}), Code::kInvalidArgument, "one of them");
    EXPECT_ERROR(status({1, 1, 2, 2}, {{"up", true}, {"down", true}}, {}), Code::kInvalidArgument,
                 "one of them");
    EXPECT_ERROR(status({1, 1, 2, 2}, down, {1, 2, 1}), Code::kInvalidArgument, "3 taps");
    EXPECT_ERROR(status({1, 1, 2, 2}, down, std::vector<float>(18, 1)), Code::kInvalidArgument,
                 "18 taps");
}

TEST(Resample2dReference, GradcheckFloat64) {
    for (const bool up : {false, true})
        expect_gradcheck(ResampleCase{{1, 2, 3, 2}, up, {1, 3, 3, 1}}.call(1));
}

TEST(Resample2dCheck, RefusesResultsBeyond31Bits) {
    EXPECT_OK(ops::resample2d_check({1, 4, 8192, 8192, true, 0}));
    EXPECT_ERROR(ops::resample2d_check({1, 4, 16384, 8192, true, 0}), Code::kUnsupported, "2^31");
    EXPECT_ERROR(ops::resample2d_check({~0U, ~0U, 2, 2, false, 0}), Code::kUnsupported, "2^31");
}

}  // namespace
}  // namespace splat::test
