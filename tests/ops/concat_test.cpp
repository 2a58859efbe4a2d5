#include "ops/concat.h"

#include <gtest/gtest.h>

#include "ops/every/op_samples.h"
#include "ref/concat_ref.h"

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
            const std::vector<double> grad = to_double(call.grad_outputs[0].values);
            const std::size_t of_a = std::size_t{c.a} * h * 3;
            expect_matches(context(), call,
                           {ref::concat_forward(n, to_double(call.inputs[0].values),
                                                to_double(call.inputs[1].values))},
                           {ref::concat_backward(n, 0, of_a, grad),
                            ref::concat_backward(n, of_a, std::size_t{c.b} * h * 3, grad)},
                           a.text() + b.text());
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
    const Arrays parts = {to_double(normal_fill(12, 1)), to_double(normal_fill(20, 2))};
    const std::vector<double> grad_y = to_double(normal_fill(32, 3));
    expect_gradcheck(
        parts, [](const Arrays& in) { return Arrays{ref::concat_forward(2, in[0], in[1]).value}; },
        {grad_y},
        {ref::concat_backward(2, 0, 6, grad_y).value,
         ref::concat_backward(2, 6, 10, grad_y).value});
}

}  // namespace
}  // namespace splat::test
