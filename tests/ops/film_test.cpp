#include "ops/film.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Film : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Film);

OpCall film_call(const Shape& x, bool scaled, std::uint64_t seed) {
    return sample(
        "film", Json::object(),
        {normal_tensor(x, seed), normal_tensor({x[0], scaled ? 2 * x[1] : x[1]}, seed + 1)}, {x});
}

TEST_P(Film, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const bool scaled : {true, false})
        for (const Shape& shape : image_shapes())
            expect_float64(context(), film_call(shape, scaled, seed += 5),
                           shape.text() + (scaled ? "" : " shift"));
}

TEST_P(Film, RejectsBadShapes) {
    for (const Shape& modulation : {Shape{2, 9}, Shape{3, 6}, Shape{2, 6, 1}, Shape{6}}) {
        OpCall call = film_call({2, 3, 4, 4}, true, 50);
        call.inputs[1] = normal_tensor(modulation, 2);
        EXPECT_ERROR(run_op(context(), call).status, Code::kShape, "'modulation'");
    }
}

TEST(FilmReference, GradcheckFloat64) {
    for (const bool scaled : {true, false}) expect_gradcheck(film_call({2, 3, 2, 2}, scaled, 60));
}

}  // namespace
}  // namespace splat::test
