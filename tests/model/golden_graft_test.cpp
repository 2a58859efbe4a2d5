// Networks grafted onto more input channels: golden/net/graft.npz, computed once with PyTorch, and
// from there to trained new channels.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "model/adapters.h"
#include "model/golden_file.h"
#include "model/training.h"
#include "model/weights.h"
#include "ops/op_harness.h"
#include "support/golden.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using model::ImageChannels;
using model::Predictor;
using model::PredictorConfig;
using model::PredictorOptions;

/// A variant of the channels behind RGB, in the words of the file.
struct Variant {
    const char* name;
    ImageChannels channels;
    std::size_t first;  ///< of the priors depth, nx, ny, nz
    std::size_t count;
};
constexpr Variant kVariants[] = {{"d", {true, false, false}, 0, 1},
                                 {"n", {false, true, false}, 1, 3},
                                 {"dn", {true, true, false}, 0, 4}};

io::NamedTensors state_of(const Golden& golden, const std::string& prefix) {
    io::NamedTensors state;
    for (const std::string& key : golden.npz.names())
        if (key.starts_with(prefix) && golden.array(key).dtype == "f4") {
            EXPECT_OK(state.add({key.substr(prefix.size()), golden.dims(key), io::NumberType::kF32,
                                 golden.floats(key)}));
        }
    return state;
}

PredictorConfig widened(PredictorConfig config, const ImageChannels& channels) {
    config.depth = channels.depth;
    config.normal = channels.normal;
    config.mask = channels.mask;
    return config;
}

/// Planes of RGB, followed by those of the priors that a variant takes, image by image.
std::vector<float> images_of(const std::vector<float>& rgb, const std::vector<float>& priors,
                             std::size_t pixels, std::size_t first, std::size_t count) {
    std::vector<float> all;
    const auto take = [&](const std::vector<float>& from, std::size_t plane, std::size_t planes) {
        const auto at = from.begin() + static_cast<std::ptrdiff_t>(plane * pixels);
        all.insert(all.end(), at, at + static_cast<std::ptrdiff_t>(planes * pixels));
    };
    for (std::size_t image = 0; image * 3 * pixels < rgb.size(); ++image) {
        take(rgb, 3 * image, 3);
        take(priors, 4 * image + first, count);
    }
    return all;
}

/// Images before the cameras of a file.
struct GraftInputs {
    GraftInputs(const Golden& golden, std::vector<float> given)
        : images(std::move(given)),
          poses(golden.floats("v2w")),
          quaternions(golden.floats("quat")) {}
    [[nodiscard]] model::PredictorInput view() const {
        return {.images = images,
                .view_to_world = poses,
                .quaternions = quaternions,
                .focals = {},
                .embedding = {},
                .tokens = {}};
    }
    std::vector<float> images, poses, quaternions;
};

class GoldenNetGraft : public KernelsTest {
  protected:
    void SetUp() override {
        SPLAT_NEEDS_GOLDEN_FOLDER();
        KernelsTest::SetUp();
    }
    std::unique_ptr<Predictor> make(const PredictorConfig& config, const io::NamedTensors& state,
                                    const PredictorOptions& options) {
        auto made = Predictor::create(context(), config, options);
        EXPECT_OK(made.status());
        if (!made.ok()) return nullptr;
        EXPECT_OK(made.value()->init(3));
        EXPECT_OK(made.value()->parameters().zero_gradients());
        model::LoadReport report;
        EXPECT_OK(model::load_state(*made.value(), state,
                                    {.source = {}, .graft = true, .take_rays = true}, report));
        return std::move(made.value());
    }
    std::vector<float> get(const vk::BufferView& view) {
        std::vector<float> values(view.shape.elements());
        EXPECT_OK(context().read(view, values.data(), values.size() * 4));
        return values;
    }
    std::vector<std::vector<float>> outputs(Predictor& predictor,
                                            const model::PredictorInput& input) {
        EXPECT_OK(predictor.set_input(input));
        EXPECT_OK(predictor.forward());
        const auto views = predictor.outputs();
        return {get(views.means), get(views.opacities), get(views.scales), get(views.rotations),
                get(views.sh)};
    }
    /// The figures of the files, and those of the network of three channels.
    void expect_golden(model::Precision precision);
};
SPLAT_INSTANTIATE_KERNELS(GoldenNetGraft);

PredictorConfig graft_config() {
    PredictorConfig c;
    c.resolution = 16;
    c.base_dim = 4;
    c.num_blocks = 1;
    c.attention_resolutions = {4};
    return c;
}

std::string first_name(const Golden& golden) {
    const NpyArray& text = golden.array("first_name");
    return {reinterpret_cast<const char*>(text.bytes.data()), text.bytes.size()};
}

/// The file's figures are float32 ones; INDEX.md gives 2e-4 for outputs of whole networks.
void expect_outputs(const std::vector<std::vector<float>>& got, const Golden& golden,
                    const std::string& prefix) {
    const char* names[] = {"xyz", "opacity", "scaling", "rotation"};
    for (std::size_t i = 0; i < 4; ++i)
        expect_absolute(prefix + names[i], got[i], to_double(golden.floats(prefix + names[i])),
                        2e-4);
}

/// Gradient of the sum of the positions and of the constant coefficients of colour.
Status put_sum_gradient(vk::Context& context, Predictor& predictor) {
    const auto gradients = predictor.output_gradients();
    for (const vk::BufferView& view : {gradients.opacities, gradients.scales, gradients.rotations})
        SPLAT_TRY(context.fill(view, 0));
    const std::vector<float> ones(gradients.means.shape.elements(), 1);
    SPLAT_TRY(context.write(gradients.means, ones.data(), ones.size() * 4));
    std::vector<float> sh(gradients.sh.shape.elements(), 0);
    const std::size_t coefficients = gradients.sh.shape[2];
    for (std::size_t i = 0; i < sh.size(); ++i) sh[i] = i / 3 % coefficients == 0 ? 1 : 0;
    return context.write(gradients.sh, sh.data(), sh.size() * 4);
}

void GoldenNetGraft::expect_golden(model::Precision precision) {
    for (const std::string& path : golden_files("net", "graft")) {
        auto npz = Npz::read(path);
        ASSERT_OK(npz.status());
        const Golden golden{std::move(npz.value()), "graft"};
        const io::NamedTensors state = state_of(golden, "old.");
        PredictorOptions options;
        options.objects = 2;
        options.gradients = options.input_gradient = true;
        options.build.precision = precision;
        const auto narrow = make(graft_config(), state, options);
        ASSERT_TRUE(narrow);
        const auto expected = outputs(*narrow, GraftInputs(golden, golden.floats("x_rgb")).view());
        expect_outputs(expected, golden, "o_old.");
        for (const Variant& variant : kVariants) {
            const std::string at = variant.name;
            const PredictorConfig config = widened(graft_config(), variant.channels);
            const auto wide = make(config, state, options);
            ASSERT_TRUE(wide);
            const nn::Parameter& first = *wide->parameters().find(first_name(golden));
            EXPECT_EQ(get(first.value), golden.floats("new_" + at + "." + first.name));
            const auto got = outputs(
                *wide,
                GraftInputs(golden, images_of(golden.floats("x_rgb"), golden.floats("x_prior"), 256,
                                              variant.first, variant.count))
                    .view());
            expect_outputs(got, golden, "o_" + at + ".");
            for (std::size_t i = 0; i < got.size(); ++i)
                expect_absolute(at + " output " + std::to_string(i), got[i], to_double(expected[i]),
                                1e-6);
            ASSERT_OK(put_sum_gradient(context(), *wide));
            ASSERT_OK(wide->backward());
            expect_relative("dfirst_" + at, get(first.grad),
                            to_double(golden.floats("dfirst_" + at)), 1e-4);
            const std::vector<float> d_x =
                wide->input_gradient(model::Predictor::Input::kImages).value();
            expect_relative("d_x_" + at, d_x, to_double(golden.floats("d_x_" + at)), 1e-4);
            const std::size_t planes = 3 + variant.count;
            for (std::size_t i = 0; i < d_x.size(); ++i)  // no weight leads there
                if (i / 256 % planes >= 3) {
                    ASSERT_EQ(d_x[i], 0) << at << " " << i;
                }
        }
    }
}

TEST_P(GoldenNetGraft, WeightsOutputsAndGradients) {
    expect_golden(model::Precision::kStrict);
}

/// With F(4x4) wherever it can be, within the same figures; plain kernels have no other algorithm.
class GoldenNetGraftFast : public GoldenNetGraft {};
INSTANTIATE_TEST_SUITE_P(Kernels, GoldenNetGraftFast,
                         testing::Values(vk::Kernels::kCpu, vk::Kernels::kGpu), kernels_test_name);

TEST_P(GoldenNetGraftFast, WeightsOutputsAndGradients) {
    expect_golden(model::Precision::kFast);
}

/// Adapters start without effect, theirs and ours.
TEST_P(GoldenNetGraft, FreshAdapters) {
    for (const std::string& path : golden_files("net", "graft")) {
        auto npz = Npz::read(path);
        ASSERT_OK(npz.status());
        const Golden golden{std::move(npz.value()), "graft"};
        io::NamedTensors state = state_of(golden, "old.");
        PredictorConfig config = widened(graft_config(), {true, true, false});
        config.lora.rank = 4;
        PredictorOptions options;
        options.objects = 2;
        options.build.precision = model::Precision::kStrict;
        const GraftInputs inputs(
            golden, images_of(golden.floats("x_rgb"), golden.floats("x_prior"), 256, 0, 4));
        const auto ours = make(config, state, options);
        ASSERT_TRUE(ours);
        const auto expected = outputs(*ours, inputs.view());
        expect_outputs(expected, golden, "o_lora.");
        std::size_t adapters = 0;
        for (const io::NamedTensor& tensor : state_of(golden, "lora_init.")) {
            const nn::Parameter* parameter = ours->parameters().find(tensor.name);
            ASSERT_NE(parameter, nullptr) << tensor.name;
            const auto largest = [](const std::vector<float>& values) {
                float most = 0;
                for (const float value : values) most = std::max(most, std::abs(value));
                return most;
            };
            const bool b = tensor.name.ends_with("lora_B");
            const auto columns = static_cast<double>(tensor.dims[1]);
            const double bound = b ? 0 : 1 / std::sqrt(columns);
            EXPECT_LE(static_cast<double>(largest(tensor.values)), bound) << tensor.name;
            EXPECT_LE(static_cast<double>(largest(get(parameter->value))), bound) << tensor.name;
            ++adapters;
            ASSERT_OK(state.add(tensor));
        }
        EXPECT_GT(adapters, 0U);
        const auto theirs = make(config, state, options);
        ASSERT_TRUE(theirs);
        EXPECT_EQ(outputs(*theirs, inputs.view()), expected);
    }
}

/// Largest magnitude of the weights of each input channel.
std::vector<float> column_sizes(const std::vector<float>& weight, const Shape& shape) {
    std::vector<float> most(shape[1], 0);
    const std::size_t taps = std::size_t{shape[2]} * shape[3];
    for (std::size_t i = 0; i < weight.size(); ++i) {
        float& size = most[i / taps % shape[1]];
        size = std::max(size, std::abs(weight[i]));
    }
    return most;
}

/// What may learn of the new channels.
enum class Learns { kAll, kAdapters, kBesideAdapters, kFirstAdapter };

struct TrainingCase {
    const Variant& variant;
    Learns learns;

    [[nodiscard]] PredictorConfig config() const {
        PredictorConfig c = widened(graft_config(), variant.channels);
        if (learns == Learns::kAll) return c;
        c.lora.rank = 4;
        if (learns == Learns::kBesideAdapters) c.lora.trained = {"16x16_conv."};
        if (learns == Learns::kFirstAdapter) c.lora.targets.emplace_back("16x16_conv");
        return c;
    }
    [[nodiscard]] std::string text() const {
        const char* names[] = {"all trained", "adapters only", "beside adapters",
                               "adapter of the first convolution"};
        return std::string(variant.name) + ", " + names[static_cast<int>(learns)];
    }
};

/// Eight networks, twenty steps of the optimiser each: with one set of kernels only.
class GoldenNetTraining : public GoldenNetGraft {
  protected:
    /// The first convolution's weight, its adapter folded in.
    std::vector<float> first_weight(Predictor& predictor, const nn::Parameter& first) {
        const auto state = model::save_state(predictor);
        EXPECT_OK(state.status());
        const auto folded =
            model::merge_adapters(state.value(), state.value(), predictor.config().lora.alpha, 1);
        EXPECT_OK(folded.status());
        return folded.value().find(first.name)->values;
    }
};
INSTANTIATE_TEST_SUITE_P(Kernels, GoldenNetTraining, testing::Values(vk::Kernels::kCpu),
                         kernels_test_name);

/// From the golden network of three channels to those of four, six and seven: equal outputs, then twenty
/// steps that move every new channel's weights, alone, beside adapters and by an adapter; and not where
/// nothing that sees the channels is trained.
TEST_P(GoldenNetTraining, MovesNewChannels) {
    const std::vector<std::string> paths = golden_files("net", "graft");
    ASSERT_FALSE(paths.empty());
    auto npz = Npz::read(paths[0]);
    ASSERT_OK(npz.status());
    const Golden golden{std::move(npz.value()), "graft"};
    const io::NamedTensors state = state_of(golden, "old.");
    PredictorOptions options;
    options.objects = 2;
    const auto narrow = make(graft_config(), state, options);
    ASSERT_TRUE(narrow);
    const auto expected = outputs(*narrow, GraftInputs(golden, golden.floats("x_rgb")).view());
    const std::vector<float> priors = normal_fill(std::size_t{2} * 4 * 256, 77);
    options.gradients = true;

    std::vector<TrainingCase> cases = {{kVariants[2], Learns::kAdapters},
                                       {kVariants[2], Learns::kFirstAdapter}};
    for (const Variant& variant : kVariants)
        for (const Learns learns : {Learns::kAll, Learns::kBesideAdapters})
            cases.push_back({variant, learns});
    for (const TrainingCase& c : cases) {
        SCOPED_TRACE(c.text());
        const auto wide = make(c.config(), state, options);
        ASSERT_TRUE(wide);
        const GraftInputs inputs(golden, images_of(golden.floats("x_rgb"), priors, 256,
                                                   c.variant.first, c.variant.count));
        const auto got = outputs(*wide, inputs.view());
        for (std::size_t i = 0; i < got.size(); ++i)
            expect_absolute("output " + std::to_string(i), got[i], to_double(expected[i]), 1e-6);
        const nn::Parameter& first = *wide->parameters().find(first_name(golden));
        const bool trained = c.learns == Learns::kAll || c.learns == Learns::kBesideAdapters;
        EXPECT_EQ(first.grad.block != nullptr, trained);
        Training training(context(), *wide);
        training.steps(20, inputs.view());
        if (testing::Test::HasFatalFailure()) return;
        const std::vector<float> columns = column_sizes(first_weight(*wide, first), first.shape);
        ASSERT_EQ(columns.size(), 3 + c.variant.count);
        for (std::size_t i = 3; i < columns.size(); ++i) {
            // Adam's steps are of the size of its rate while gradients keep their signs; an adapter's
            // product has as second factor numbers of up to 1 / sqrt(9 * 7), and 1/4 for alpha / rank.
            if (trained) {
                EXPECT_GT(columns[i], 5e-3F) << "channel " << i;
            } else if (c.learns == Learns::kFirstAdapter) {
                EXPECT_GT(columns[i], 1e-4F) << "channel " << i;
            } else {
                EXPECT_EQ(columns[i], 0) << "channel " << i;
            }
        }
    }
}

}  // namespace
}  // namespace splat::test
