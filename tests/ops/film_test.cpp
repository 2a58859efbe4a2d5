#include "ops/film.h"

#include <gtest/gtest.h>

#include "ops/every/op_samples.h"
#include "ref/film_ref.h"

namespace splat::test {
namespace {

class Film : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Film);

OpCall film_call(const Shape& x, bool scaled, std::uint64_t seed) {
    return sample(
        "film", Json::object(),
        {normal_tensor(x, seed), normal_tensor({x[0], scaled ? 2 * x[1] : x[1]}, seed + 1)}, {x});
}

ref::FilmInput<double> reference(const OpCall& call, bool scaled) {
    const Shape& x = call.inputs[0].shape;
    const std::size_t planes = std::size_t{x[0]} * x[1];
    return {x[0],
            x[1],
            x.elements() / planes,
            scaled,
            to_double(call.inputs[0].values),
            to_double(call.inputs[1].values)};
}

TEST_P(Film, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const bool scaled : {true, false})
        for (const Shape& shape : image_shapes()) {
            const OpCall call = film_call(shape, scaled, seed += 5);
            const auto input = reference(call, scaled);
            const auto grad = ref::film_backward(input, to_double(call.grad_outputs[0].values));
            expect_matches(context(), call, {ref::film_forward(input)},
                           {grad.grad_x, grad.grad_modulation},
                           shape.text() + (scaled ? "" : " shift"));
        }
}

TEST_P(Film, RejectsBadShapes) {
    for (const Shape& modulation : {Shape{2, 9}, Shape{3, 6}, Shape{2, 6, 1}, Shape{6}}) {
        OpCall call = film_call({2, 3, 4, 4}, true, 50);
        call.inputs[1] = normal_tensor(modulation, 2);
        EXPECT_ERROR(run_op(context(), call).status, Code::kShape, "'modulation'");
    }
}

TEST(FilmReference, GradcheckFloat64) {
    for (const bool scaled : {true, false}) {
        const OpCall call = film_call({2, 3, 2, 2}, scaled, 60);
        const auto input = reference(call, scaled);
        const std::vector<double> grad_y = to_double(call.grad_outputs[0].values);
        const auto grad = ref::film_backward(input, grad_y);
        expect_gradcheck({input.x, input.modulation},
                         [&](const Arrays& in) {
                             auto changed = input;
                             changed.x = in[0];
                             changed.modulation = in[1];
                             return Arrays{ref::film_forward(changed).value};
                         },
                         {grad_y}, {grad.grad_x.value, grad.grad_modulation.value});
    }
}

}  // namespace
}  // namespace splat::test
