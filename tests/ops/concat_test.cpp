#include "ops/concat.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Concat : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Concat);

TEST_P(Concat, MovesEveryElement) {
    std::uint64_t seed = 10;
    struct Channels {
        std::uint32_t a;
        std::uint32_t b;
    };
    for (const Channels& c : {Channels{1, 1}, Channels{4, 4}, Channels{8, 3}, Channels{3, 8},
                              Channels{5, 2}, Channels{2, 7}, Channels{7, 6}, Channels{6, 1},
                              Channels{13, 9}, Channels{16, 32}, Channels{129, 1}, Channels{1, 65}})
        for (const std::uint32_t n : {1U, 3U}) {
            const std::uint32_t h = n == 1 ? 17 : 5;
            const Shape a{n, c.a, h, 3};
            const Shape b{n, c.b, h, 3};
            seed += 4;
            const OpCall call = sample("concat", Json::object(),
                                       {normal_tensor(a, seed), normal_tensor(b, seed + 1)},
                                       {Shape{n, c.a + c.b, h, 3}});
            expect_float64(context(), call, a.text() + b.text());
        }
}

TEST_P(Concat, RejectsBadShapes) {
    for (const Shape& b : {Shape{2, 3, 4, 5}, Shape{1, 3, 5, 4}, Shape{1, 3, 20}})
        EXPECT_ERROR(run_op(context(), sample("concat", Json::object(),
                                              {normal_tensor({1, 3, 4, 5}, 1), normal_tensor(b, 2)},
                                              {Shape{1, 6, 4, 5}}))
                         .status,
                     Code::kShape, "'b'");
}

TEST(ConcatReference, GradcheckFloat64) {
    expect_gradcheck(sample("concat", Json::object(),
                            {normal_tensor({2, 3, 2}, 1), normal_tensor({2, 5, 2}, 2)},
                            {Shape{2, 8, 2}}));
}

}  // namespace
}  // namespace splat::test
