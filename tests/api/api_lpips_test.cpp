#include <limits>

#include "api/evaluate/lpips_calls.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

/// Values against PyTorch's: tests/interop/lpips.py.
TEST(ApiLpips, IsADistance) {
    const Device device = open_device();
    const Lpips lpips = make_lpips(device);
    const Floats a = normal_fill(3 * kLpipsSide * kLpipsSide, 1, 0.5, 0.2);
    Floats near = a, far = a;
    const Floats noise = normal_fill(a.size(), 2);
    for (std::size_t i = 0; i < a.size(); ++i) {
        near[i] += 0.01F * noise[i];
        far[i] += 0.2F * noise[i];
    }
    const auto distance = [&](const Floats& x, const Floats& y) {
        double value = -1;
        const splat_image first = planes_image(x.data(), kLpipsSide),
                          second = planes_image(y.data(), kLpipsSide);
        EXPECT_DONE(splat_lpips_compare(lpips, &first, &second, &value));
        return value;
    };
    EXPECT_EQ(distance(a, a), 0);
    EXPECT_GT(distance(a, near), 0);
    EXPECT_GT(distance(a, far), distance(a, near));
    EXPECT_EQ(distance(a, far), distance(far, a));

    far[5] = std::numeric_limits<float>::quiet_NaN();
    double value = -1;
    const splat_image good = planes_image(a.data(), kLpipsSide);
    const splat_image broken = planes_image(far.data(), kLpipsSide);
    EXPECT_REFUSED(splat_lpips_compare(lpips, &good, &broken, &value), kArgument,
                   "b holds nan at 5");
    const splat_image small = planes_image(a.data(), kLpipsSide - 1);
    EXPECT_REFUSED(splat_lpips_compare(lpips, &small, &good, &value), kShape,
                   "a is 15 x 15 pixels");
    EXPECT_EQ(value, -1) << "untouched";
}

}  // namespace
}  // namespace splat::test
