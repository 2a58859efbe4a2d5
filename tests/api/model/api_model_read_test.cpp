// Results of a model, read by name.
#include "api/api_calls.h"

namespace splat::test {
namespace {

/// The memory for rows of a result is made by the first call that gives some.
TEST(ApiModelRead, RefusedCallsLeaveTheMemoryAlone) {
    const Device device = open_device();
    const Model model = random_model(device);
    const auto live_bytes = [&] { return got(splat_device_get_memory, device).live_bytes; };
    Floats values(3 * 16 * 16, 0.5F);
    const std::size_t bytes = values.size() * sizeof(float);
    const std::uint64_t before = live_bytes();
    EXPECT_REFUSED(splat_model_read(model, "means", values.data(), bytes), kState, "has not run");
    forward(model, values);
    EXPECT_REFUSED(splat_model_read(model, "means", values.data(), bytes - 1), kArgument,
                   "'means' takes 3072");
    EXPECT_REFUSED(splat_model_read(model, "means[1]", values.data(), bytes), kArgument,
                   "expected an object less than 1");
    const Tensor images = got(splat_model_tensor, model, "images");
    mapped(images, SPLAT_ACCESS_READ);
    EXPECT_REFUSED(splat_model_read(model, "means", values.data(), bytes), kState, "is mapped");
    ASSERT_DONE(splat_tensor_unmap(images));
    EXPECT_EQ(live_bytes(), before);
    EXPECT_DONE(splat_model_read(model, "means", values.data(), bytes));
    EXPECT_GT(live_bytes(), before);
}

}  // namespace
}  // namespace splat::test
