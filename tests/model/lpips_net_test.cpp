#include "model/lpips_net.h"

#include <gtest/gtest.h>

#include "model/lpips_weights.h"
#include "ops/op_harness.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using model::LpipsDesc;
using model::LpipsNet;

constexpr std::uint32_t kSide = 17;  // odd: the first halving drops a row and a column

/// The operators are tested under all kernels; values and gradients against PyTorch's: tests/interop.
class LpipsRules : public KernelsTest {
  protected:
    Result<std::unique_ptr<LpipsNet>> make(const io::NamedTensors& vgg,
                                           const io::NamedTensors& linear,
                                           const LpipsDesc& desc = {.images = 2, .side = kSide}) {
        const io::NamedTensors* files[] = {&vgg, &linear};
        return LpipsNet::create(context(), desc, files);
    }
    void put(const vk::BufferView& view, const std::vector<float>& values) {
        ASSERT_EQ(view.shape.elements(), values.size());
        EXPECT_OK(context().write(view, values.data(), values.size() * 4));
    }
    std::vector<float> get(const vk::BufferView& view) {
        std::vector<float> values(view.shape.elements());
        EXPECT_OK(context().read(view, values.data(), values.size() * 4));
        return values;
    }
};
INSTANTIATE_TEST_SUITE_P(Kernels, LpipsRules, testing::Values(vk::Kernels::kCpu),
                         kernels_test_name);

TEST_P(LpipsRules, EqualImagesAreAtDistanceZero) {
    const auto net = need(make(vgg_weights(), linear_weights()));
    const std::size_t image = std::size_t{3} * kSide * kSide;
    std::vector<float> render = normal_fill(2 * image, 3, 0.5, 0.2);
    std::vector<float> target = render;
    for (std::size_t i = image; i < 2 * image; ++i) target[i] = 1 - target[i];
    const auto run = [&] {
        put(net->render(), render);
        put(net->target(), target);
        EXPECT_OK(net->forward());
        return get(net->values());
    };
    const std::vector<float> values = run();
    EXPECT_EQ(values[0], 0) << "the first images are the same";
    EXPECT_GT(values[1], 0.01F);
    put(net->value_gradients(), {1, 1});
    ASSERT_OK(net->backward());
    const std::vector<float> gradient = get(net->render_gradient());
    double slope = 0;
    for (std::size_t i = 0; i < gradient.size(); ++i) {
        if (i < image) {
            EXPECT_EQ(gradient[i], 0) << i;
        }
        slope += std::pow(static_cast<double>(gradient[i]), 2);
    }
    // A step against the gradient lowers the distance by about the predicted amount.
    const double step = 1e-3 / std::sqrt(slope);
    for (std::size_t i = 0; i < gradient.size(); ++i)
        render[i] -= static_cast<float>(step) * gradient[i];
    const double fall = static_cast<double>(values[1]) - static_cast<double>(run()[1]);
    EXPECT_NEAR(fall / (step * slope), 1, 0.2);
}

/// [2,C,kSide,kSide] to quads, or [2,1] to quads.
std::vector<float> quads_of(const std::vector<float>& planes, std::size_t channels) {
    const std::size_t pixels = planes.size() / (2 * channels);
    std::vector<float> quads(8 * pixels);
    for (std::size_t i = 0; i < planes.size(); ++i) {
        const std::size_t image = i / (channels * pixels), c = i / pixels % channels;
        quads[4 * (image * pixels + i % pixels) + c] = planes[i];
    }
    return quads;
}

TEST_P(LpipsRules, QuadsGiveTheBitsOfRows) {
    const std::vector<float> render = normal_fill(6 * kSide * kSide, 3, 0.5, 0.2);
    const std::vector<float> target = normal_fill(6 * kSide * kSide, 4, 0.5, 0.2);
    const std::vector<float> slopes = {0.5F, -2};
    const auto rows = make(vgg_weights(), linear_weights());
    ASSERT_OK(rows.status());
    put(rows.value()->render(), render);
    put(rows.value()->target(), target);
    put(rows.value()->value_gradients(), slopes);
    ASSERT_OK(rows.value()->forward());
    ASSERT_OK(rows.value()->backward());
    std::vector<float> expected = quads_of(get(rows.value()->render_gradient()), 3);
    for (float& value : expected) value += 1;  // alpha's gradient, too

    const vk::Buffer a = upload(context(), quads_of(render, 3));
    const vk::Buffer b = upload(context(), quads_of(target, 3));
    const vk::Buffer value = device_buffer(context(), 8);
    const vk::Buffer grad_value = upload(context(), quads_of(slopes, 1));
    const vk::Buffer grad = upload(context(), std::vector<float>(expected.size(), 1));
    const auto net =
        make(vgg_weights(), linear_weights(),
             {.images = 2,
              .side = kSide,
              .quads = {{a.range(), b.range(), value.range(), grad_value.range(), grad.range()}}});
    ASSERT_OK(net.status());
    ASSERT_OK(net.value()->forward());
    ASSERT_OK(net.value()->backward());
    EXPECT_EQ(download(context(), value.range(), 8), quads_of(get(rows.value()->values()), 1));
    EXPECT_EQ(download(context(), grad.range(), expected.size()), expected);
}

TEST_P(LpipsRules, RefusesOtherWeights) {
    const auto changed = [](const io::NamedTensors& from, const std::string& name,
                            const std::function<void(io::NamedTensor&)>& change) {
        io::NamedTensors made;
        for (io::NamedTensor tensor : from) {
            if (tensor.name == name) change(tensor);
            EXPECT_OK(made.add(std::move(tensor)));
        }
        return made;
    };
    const io::NamedTensors linear = linear_weights();
    EXPECT_ERROR(make(vgg_weights(), vgg_weights()), Code::kInvalidArgument,
                 "no file has the tensor 'lin0.model.1.weight' [64]");
    EXPECT_ERROR(make(linear, linear), Code::kInvalidArgument,
                 "no file has the tensor 'features.0.weight' [64, 3, 3, 3]");
    EXPECT_ERROR(make(vgg_weights(), changed(linear, "lin3.model.1.weight",
                                             [](io::NamedTensor& t) {
                                                 t.dims = {1, 256, 1, 1};
                                                 t.values.own().resize(256);
                                             })),
                 Code::kShape, "'lin3.model.1.weight' has shape [1, 256, 1, 1], expected [512]");
    EXPECT_ERROR(make(vgg_weights(), changed(linear, "lin2.model.1.weight",
                                             [](io::NamedTensor& t) { t.values.own()[7] = NAN; })),
                 Code::kInvalidArgument, "'lin2.model.1.weight' holds nan at 7");
    EXPECT_ERROR(make(vgg_weights(), linear, {.images = 1, .side = 15}), Code::kInvalidArgument,
                 "1 images of 15 pixels");
    EXPECT_ERROR(make(vgg_weights(), linear, {.images = 0, .side = 32}), Code::kInvalidArgument,
                 "0 images");
}

}  // namespace
}  // namespace splat::test
