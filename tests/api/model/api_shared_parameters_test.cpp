// Memory of a model that others use: parameters written through pointers and by optimizers, tensors that are mapped.
#include "api/api_calls.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr const char* kWeight = "network_with_offset.encoder.enc.16x16_conv.weight";

/// A model with a tensor of its first weight, and one that gets the same weight by splat_model_write.
class ApiSharedParameters : public testing::Test {
  protected:
    void SetUp() override {
        ASSERT_DONE(splat_model_init(model_, 3));
        ASSERT_DONE(splat_model_init(host_, 3));
        ASSERT_DONE(splat_model_tensor(model_, kWeight, weight_.out()));
        raw(model_);
        raw(model_);  // keeps prepared weights
    }
    Floats raw(const Model& model) {
        forward(model, image_);
        return floats_of(24 * 16 * 16, splat_model_read, model, "raw");
    }
    void expect_same(const Floats& weight, const char* how) {
        ASSERT_DONE(
            splat_model_write(host_, kWeight, weight.data(), weight.size() * sizeof(float)));
        const Floats expected = raw(host_);
        for (int pass = 0; pass < 3; ++pass) EXPECT_EQ(raw(model_), expected) << how;
    }

    Device device_ = open_device();
    const Model model_ = make_model(device_);
    const Model host_ = make_model(device_);
    Tensor weight_;
    const Floats image_ = normal_fill(3 * 16 * 16, 4);
};

TEST_F(ApiSharedParameters, PointersAreFollowed) {
    void* pointer = nullptr;
    ASSERT_DONE(splat_tensor_host_pointer(weight_, &pointer, nullptr));
    auto* const values = static_cast<float*>(pointer);
    Floats expected = download(weight_);
    for (const float value : {0.5F, -0.75F}) {
        values[3] = expected[3] = value;
        expect_same(expected, "written unnoticed");
    }
    values[4] = expected[4] = 0.25F;
    weight_.destroy();
    expect_same(expected, "written before the tensor was destroyed");
}

TEST_F(ApiSharedParameters, OptimizersAreFollowed) {
    const Tensor gradient = upload(device_, {8, 3, 3, 3}, normal_fill(216, 6));
    splat_optimizer_item item = {};
    item.name = "weight";
    item.parameter = weight_;
    item.gradient = gradient;
    splat_optimizer_desc desc = optimizer_desc(&item);
    desc.rate = 0.1;
    const Optimizer optimizer = got(splat_optimizer_create, device_, &desc);
    const Floats before = download(weight_);
    for (int step = 0; step < 2; ++step) {
        ASSERT_DONE(splat_optimizer_step(optimizer, nullptr));
        const Floats after = download(weight_);
        EXPECT_NE(after, before);
        expect_same(after, "splat_optimizer_step");
    }
}

/// An optimizer of a whole model does not step while the host writes one of its parameters.
TEST_F(ApiSharedParameters, OptimizersWaitForTheHost) {
    splat_model_desc desc = model_desc();
    desc.flags = SPLAT_MODEL_GRADIENTS;
    splat_optimizer_item item = {};
    const Model trained = got(splat_model_create, device_, &desc);
    item.model = trained;
    splat_optimizer_desc rule = optimizer_desc(&item);
    const Optimizer optimizer = got(splat_optimizer_create, device_, &rule);
    Tensor weight;
    void* pointer = nullptr;
    ASSERT_DONE(splat_model_tensor(trained, kWeight, weight.out()));
    ASSERT_DONE(splat_tensor_map(weight, SPLAT_ACCESS_WRITE, &pointer, nullptr));
    EXPECT_REFUSED(splat_optimizer_step(optimizer, nullptr), kState,
                   "a tensor of the model is mapped");
    ASSERT_DONE(splat_tensor_unmap(weight));
    EXPECT_DONE(splat_optimizer_step(optimizer, nullptr));
}

/// Whoever holds the pointer of a mapped tensor is alone with its memory.
TEST_F(ApiSharedParameters, MappedMemoryIsNotUsedByOthers) {
    const auto tensor = [&](const char* name) { return got(splat_model_tensor, model_, name); };
    const auto refuses = [](const Tensor& one, std::size_t elements) {
        constexpr const char* kShared = "shares memory with a tensor that is mapped";
        void* other = nullptr;
        Floats values(elements);
        const std::size_t bytes = values.size() * sizeof(float);
        EXPECT_REFUSED(splat_tensor_map(one, SPLAT_ACCESS_READ, &other, nullptr), kState, kShared);
        EXPECT_REFUSED(splat_tensor_read(one, values.data(), bytes, nullptr), kState, kShared);
        EXPECT_REFUSED(splat_tensor_write(one, values.data(), bytes, nullptr), kState, kShared);
    };
    const Tensor again = tensor(kWeight), means = tensor("means"), part = tensor("means[0]");
    mapped(weight_, SPLAT_ACCESS_READ_WRITE);
    refuses(again, 216);
    splat_weights weights = nullptr;
    Floats values(216);
    const std::size_t bytes = values.size() * sizeof(float);
    constexpr const char* kMapped = "a tensor of the model is mapped";
    EXPECT_REFUSED(splat_model_init(model_, 1), kState, kMapped);
    EXPECT_REFUSED(splat_model_store(model_, &weights), kState, kMapped);
    EXPECT_REFUSED(splat_model_read(model_, kWeight, values.data(), bytes), kState, kMapped);
    EXPECT_REFUSED(splat_model_write(model_, kWeight, values.data(), bytes), kState, kMapped);
    mapped(part, SPLAT_ACCESS_READ);  // other memory
    refuses(means, 3 * 16 * 16);
    EXPECT_EQ(dims_of(tensor("raw[0]")).size(), 4U) << "views, channels, rows, columns";
    ASSERT_DONE(splat_tensor_unmap(part));
    ASSERT_DONE(splat_tensor_unmap(weight_));
    EXPECT_DONE(splat_model_read(model_, kWeight, values.data(), bytes));
    mapped(again, SPLAT_ACCESS_READ);
    EXPECT_DONE(splat_tensor_unmap(again));
}

}  // namespace
}  // namespace splat::test
