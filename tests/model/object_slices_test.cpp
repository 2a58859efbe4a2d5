// A batch in slices of objects equals the whole batch, except for rounding and the masks of dropout.
#include <algorithm>
#include <cmath>

#include "small_model.h"

namespace splat::test {
namespace {

class ObjectSlices : public ModelTest {};

SPLAT_INSTANTIATE_KERNELS(ObjectSlices);

/// Outputs and gradients of a batch of four objects.
struct Batch {
    std::vector<std::vector<float>> outputs, gradients;
};

ModelOptions options_of(std::uint64_t most_bytes) {
    ModelOptions options;
    options.objects = 4;
    options.gradients = options.input_gradient = true;
    options.most_bytes = most_bytes;
    return options;
}

double norm(const std::vector<float>& values) {
    double sum = 0;
    for (const float value : values) sum += static_cast<double>(value) * static_cast<double>(value);
    return std::sqrt(sum);
}

TEST_P(ObjectSlices, GiveWhatTheWholeGives) {
    ModelConfig config = small_config();
    config.views = 2;
    config.embedding = model::Embedding::kPose;
    config.tokens = 5;
    config.token_dim = 7;
    Inputs inputs(config, 4, 17);
    for (std::size_t i = 0; i < 8; ++i) inputs.poses[16 * i + 12] = 0.1F * static_cast<float>(i);
    const auto run_batch = [&](Model& model) {
        Batch batch;
        randomise(model, 90);
        batch.outputs.push_back(run(model, inputs));
        const auto o = model.outputs().value();
        for (const auto& view : {o.means, o.opacities, o.scales, o.rotations, o.sh})
            batch.outputs.push_back(read(view));
        write_gradients(model, 91);
        EXPECT_OK(model.backward());
        for (const auto input : {Model::Input::kImages, Model::Input::kTokens}) {
            const auto gradient = model.input_gradient(input);
            EXPECT_OK(gradient);
            if (gradient.ok()) batch.gradients.push_back(gradient.value());
        }
        for (const nn::Parameter& parameter : model.parameters().all())
            batch.gradients.push_back(read(parameter.grad));
        return batch;
    };
    const auto whole = make(config, options_of(0));
    ASSERT_EQ(whole->slices(), 1U);
    const Batch expected = run_batch(*whole);
    // The largest activation of an object has the 24 channels that the decoder concatenates.
    const std::uint64_t of_object = std::uint64_t{config.views} * 16 * 16 * 24 * 4;
    for (const auto& [most, slices] :
         {std::pair{std::uint64_t{1}, 4U}, std::pair{2 * of_object, 2U}}) {
        const auto sliced = make(config, options_of(most));
        EXPECT_EQ(sliced->slices(), slices);
        EXPECT_LT(sliced->executor().memory().arenas, whole->executor().memory().arenas);
        const Batch got = run_batch(*sliced);
        ASSERT_EQ(got.outputs.size(), expected.outputs.size());
        ASSERT_EQ(got.gradients.size(), expected.gradients.size());
        // Sums over pixels are cut at other places, so float32 rounds differently.
        for (std::size_t i = 0; i < got.outputs.size(); ++i)
            EXPECT_LE(relative_l2(got.outputs[i], expected.outputs[i]), 1e-6) << i;
        // A bias of keys shifts all scores of a query, which softmax does not see: its gradient is
        // rounding.
        for (std::size_t i = 0; i < got.gradients.size(); ++i)
            if (norm(expected.gradients[i]) > 1e-7)
                EXPECT_LE(relative_l2(got.gradients[i], expected.gradients[i]), 1e-5) << i;
            else
                EXPECT_LE(norm(got.gradients[i]), 1e-7) << i;
    }
}

/// Each slice has its own dropout, and its backward pass uses the mask of its forward pass: the first slice
/// equals a batch of one object, and its gradients are computed after those of the others.
TEST_P(ObjectSlices, HaveDropoutOfTheirOwn) {
    ModelConfig config = small_config();
    config.dropout = 0.5F;
    ModelOptions options = options_of(1);
    options.build.training = true;
    const auto sliced = make(config, options);
    options.objects = 1;
    const auto single = make(config, options);
    Inputs inputs(config, 4, 17);
    const auto quarter = static_cast<std::ptrdiff_t>(inputs.images.size() / 4);
    for (std::ptrdiff_t i = 1; i < 4; ++i)
        std::copy_n(inputs.images.begin(), quarter, inputs.images.begin() + i * quarter);
    Inputs one(config, 1);
    one.images.assign(inputs.images.begin(), inputs.images.begin() + quarter);
    std::vector<std::vector<float>> gradients[2];
    for (Model* model : {sliced.get(), single.get()}) {
        randomise(*model, 90);
        const std::vector<float> raw = run(*model, model == single.get() ? one : inputs);
        const auto part = static_cast<std::ptrdiff_t>(raw.size() / 4);
        for (std::ptrdiff_t i = 1; i < 4 && model == sliced.get(); ++i)
            EXPECT_FALSE(std::equal(raw.begin(), raw.begin() + part, raw.begin() + i * part)) << i;
        const auto g = model->output_gradients().value();
        for (const auto& view : {g.means, g.opacities, g.scales, g.rotations, g.sh})
            ASSERT_OK(context().fill(view, 0));
        const std::vector<float> of_first = normal_fill(16 * 16 * 3, 91);
        ASSERT_OK(context().write(g.means, of_first.data(), of_first.size() * 4));
        ASSERT_OK(model->backward());
        EXPECT_EQ(model->backward().code(), Code::kInvalidState);
        for (const nn::Parameter& parameter : model->parameters().all())
            gradients[model == single.get() ? 1 : 0].push_back(read(parameter.grad));
    }
    EXPECT_EQ(gradients[0], gradients[1]);
}

TEST_P(ObjectSlices, RefuseWhatDoesNotFit) {
    const ModelConfig config = small_config();
    const auto sliced = make(config, options_of(1));
    const Inputs one(config, 1);
    EXPECT_EQ(sliced->set_input(one.view()).code(), Code::kShape);
    EXPECT_EQ(sliced->backward().code(), Code::kInvalidState);
    const std::vector<float> first = run(*sliced, Inputs(config, 4, 17));
    Inputs bad(config, 4, 18);
    bad.images.back() = NAN;
    EXPECT_EQ(sliced->set_input(bad.view()).code(), Code::kInvalidArgument);
    EXPECT_OK(sliced->forward());
    EXPECT_EQ(read(sliced->raw_output()), first) << "refused input leaves the previous one";
}

/// Inputs that stand in tensors, in one pass and in slices, give what arrays give.
TEST_P(ObjectSlices, TakeTensors) {
    ModelConfig config = small_config();
    config.embedding = model::Embedding::kCustom;
    config.embedding_dim = 2;
    config.tokens = 5;
    config.token_dim = 7;
    config.origin_distance = true;
    const std::size_t pixels = std::size_t{config.resolution} * config.resolution;
    Inputs inputs(config, 4, 17);
    std::vector<float> shown, distances;
    for (std::size_t i = 0; i < 4; ++i) {
        const auto plane =
            inputs.images.begin() + static_cast<std::ptrdiff_t>((4 * i + 3) * pixels);
        std::fill_n(plane, pixels, 1.5F + static_cast<float>(i));
        distances.push_back(*plane);
        shown.insert(shown.end(), plane - static_cast<std::ptrdiff_t>(3 * pixels), plane);
    }
    const std::vector<float> embedding = normal_fill(4 * config.embedding_length(), 18);
    model::ModelInput given = inputs.view();
    given.embedding = embedding;
    for (const std::uint64_t most_bytes : {0, 1}) {
        std::vector<float> results[2], gradients[2];
        for (const bool tensors : {false, true}) {
            const auto model = make(config, options_of(most_bytes));
            EXPECT_EQ(model->slices(), most_bytes == 0 ? 1U : 4U);
            randomise(*model, 90);
            if (tensors) {
                const std::pair<const char*, const std::vector<float>*> all[] = {
                    {"images", &shown},
                    {"origin_distance", &distances},
                    {"embedding", &embedding},
                    {"tokens", &inputs.tokens},
                    {"view_to_world", &inputs.poses}};
                for (const auto& [name, values] : all) {
                    const auto view = need(model->input_tensor(name));
                    ASSERT_EQ(view.shape.elements(), values->size()) << name;
                    ASSERT_OK(context().write(view, values->data(), values->size() * 4));
                }
                ASSERT_OK(model->use_tensors(0, 0));
            } else {
                ASSERT_OK(model->set_input(given));
            }
            ASSERT_OK(model->forward());
            results[tensors ? 1 : 0] = read(model->outputs().value().means);
            write_gradients(*model, 91);
            ASSERT_OK(model->backward());
            gradients[tensors ? 1 : 0] = model->input_gradient(Model::Input::kEmbedding).value();
        }
        EXPECT_EQ(results[0], results[1]) << most_bytes;
        EXPECT_EQ(gradients[0], gradients[1]) << most_bytes;
        EXPECT_GT(norm(gradients[0]), 0) << most_bytes;
    }
}

}  // namespace
}  // namespace splat::test
