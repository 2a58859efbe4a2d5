// Results of a model, read by name.
#include "api/api_calls.h"

namespace splat::test {
namespace {

/// The memory for rows of a result is made by the first call that gives some.
TEST(ApiModelRead, RefusedCallsLeaveTheMemoryAlone) {
    const Device device = open_device();
    const Model model = make_model(device);
    ASSERT_DONE(splat_model_init(model, 3));
    const auto live_bytes = [&] {
        auto memory = sized<splat_memory_info>();
        EXPECT_DONE(splat_device_get_memory(device, &memory));
        return memory.live_bytes;
    };
    std::vector<float> values(3 * 16 * 16, 0.5F);
    const std::size_t bytes = values.size() * sizeof(float);
    auto input = sized<splat_model_input>();
    input.images = values.data();
    const std::uint64_t before = live_bytes();
    EXPECT_REFUSED(splat_model_read(model, "means", values.data(), bytes),
                   SPLAT_ERROR_INVALID_STATE, "has not run");
    ASSERT_DONE(splat_model_forward(model, &input));
    EXPECT_REFUSED(splat_model_read(model, "means", values.data(), bytes - 1),
                   SPLAT_ERROR_INVALID_ARGUMENT, "'means' takes 3072");
    EXPECT_REFUSED(splat_model_read(model, "means[1]", values.data(), bytes),
                   SPLAT_ERROR_INVALID_ARGUMENT, "expected an object less than 1");
    Tensor images;
    ASSERT_DONE(splat_model_tensor(model, "images", images.out()));
    void* mapped = nullptr;
    ASSERT_DONE(splat_tensor_map(images, SPLAT_ACCESS_READ, &mapped, nullptr));
    EXPECT_REFUSED(splat_model_read(model, "means", values.data(), bytes),
                   SPLAT_ERROR_INVALID_STATE, "is mapped");
    ASSERT_DONE(splat_tensor_unmap(images));
    EXPECT_EQ(live_bytes(), before);
    EXPECT_DONE(splat_model_read(model, "means", values.data(), bytes));
    EXPECT_GT(live_bytes(), before);
}

}  // namespace
}  // namespace splat::test
