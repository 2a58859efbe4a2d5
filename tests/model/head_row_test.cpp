// One more row of the table of heads, in a whole model.
#include <gtest/gtest.h>

#include "config/config_file.h"
#include "config/heads.h"
#include "model/small_model.h"
#include "ref/gaussian_head_ref.h"

namespace splat::test {
namespace {

class ModelHeadRow : public ModelTest {
  protected:
    static ModelConfig config() {
        constexpr config::Head kMine[] = {config::kHeads[0],
                                          {"mine",
                                           {.scales = kHeadSoftplus,
                                            .isotropic = true,
                                            .sh_degree = 0,
                                            .direct = true,
                                            .per_pixel = 2},
                                           {1, 0},
                                           {1e-3F, 0},
                                           {1, -1},
                                           {1, 0.03F},
                                           0.1F}};
        const Config given = need(read_yaml_config("model: {head: mine}", "test.yaml"));
        const ModelConfig read = need(config::model_config(given, kMine));
        ModelConfig small = small_config();
        config::take_head(kMine[1], small);
        EXPECT_EQ(small.output_channels(), read.output_channels());
        return small;
    }

    /// What the head makes of the network's output by its reference.
    ref::GaussianHeadInput head_input(const Model& model, const Inputs& inputs) {
        const auto doubles = [](const std::vector<float>& values) {
            return std::vector<double>(values.begin(), values.end());
        };
        const std::size_t side = model.config().resolution;
        return {{1, side * side, model.config().head()},
                doubles(read(model.raw_output())),
                doubles(model.rays()),
                doubles(inputs.poses),
                doubles(inputs.quaternions),
                {},
                {}};
    }
};
SPLAT_INSTANTIATE_KERNELS(ModelHeadRow);

TEST_P(ModelHeadRow, GivesGaussiansAndGradients) {
    ModelOptions options;
    options.gradients = options.build.training = true;
    const ModelConfig network = config();
    const auto model = make(network, options);
    const Inputs inputs(network);
    run(*model, inputs);
    const ref::GaussianHeadInput head = head_input(*model, inputs);
    EXPECT_EQ(head.net_out.size(), 2U * 15 * head.shape.pixels)
        << "depth, point, opacity, scale, rotation, colour";
    const Model::Outputs out = need(model->outputs());
    const auto expected = ref::gaussian_head_forward<double>(head);
    const vk::BufferView views[] = {out.means, out.opacities, out.scales, out.rotations, out.sh};
    for (std::size_t i = 0; i < 5; ++i) {
        const std::vector<double> wanted = expected[i];
        EXPECT_LE(relative_l2(read(views[i]), {wanted.begin(), wanted.end()}), 1e-6) << i;
    }

    write_gradients(*model, 8);
    ASSERT_OK(model->backward());
    ref::GaussianHeadOutputs<double> grads;
    for (std::size_t i = 0; i < 5; ++i) {
        const std::vector<float> values = normal_fill(expected[i].size(), 8);
        grads[i].assign(values.begin(), values.end());
    }
    const std::vector<double> by_output = ref::gaussian_head_backward<double>(head, grads);
    std::vector<float> by_bias(network.output_channels());
    for (std::size_t c = 0; c < by_bias.size(); ++c) {
        double sum = 0;
        for (std::size_t p = 0; p < head.shape.pixels; ++p)
            sum += by_output[c * head.shape.pixels + p];
        by_bias[c] = static_cast<float>(sum);
    }
    const nn::Parameter* bias = model->parameters().find("network_with_offset.out.bias");
    ASSERT_NE(bias, nullptr);
    EXPECT_LE(relative_l2(read(bias->grad), by_bias), 1e-5);
}

}  // namespace
}  // namespace splat::test
