// Networks grafted onto more input channels: golden/net/graft.npz, computed once with PyTorch, and
// the training of the new channels.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "model/adam_steps.h"
#include "model/adapters.h"
#include "model/weights.h"
#include "ops/op_harness.h"
#include "support/golden_file.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using model::Model;
using model::ModelConfig;
using model::ModelOptions;

io::NamedTensors state_of(const Golden& golden, const std::string& prefix) {
    io::NamedTensors state;
    for (const std::string& key : golden.npz.names())
        if (key.starts_with(prefix) && golden.array(key).dtype == "f4") {
            EXPECT_OK(state.add({key.substr(prefix.size()), golden.dims(key), io::NumberType::kF32,
                                 golden.floats(key)}));
        }
    return state;
}

/// A choice of channels behind RGB, named by their letters as in the file: d(epth), n(ormal), m(ask).
struct Variant {
    std::string name;

    [[nodiscard]] bool has(char letter) const { return name.find(letter) != std::string::npos; }
    /// Planes of the priors depth, nx, ny, nz, mask.
    [[nodiscard]] std::vector<std::size_t> planes() const {
        std::vector<std::size_t> all;
        if (has('d')) all.push_back(0);
        if (has('n')) all.insert(all.end(), {1, 2, 3});
        if (has('m')) all.push_back(4);
        return all;
    }
    [[nodiscard]] ModelConfig widened(ModelConfig config) const {
        config.depth = has('d');
        config.normal = has('n');
        config.mask = has('m');
        return config;
    }
};

/// The widest last.
std::vector<Variant> variants_of(const Golden& golden) {
    std::set<std::string> names;
    for (const std::string& key : golden.npz.names())
        if (key.starts_with("dfirst_")) names.insert(key.substr(7));
    golden.expect_cases({names.begin(), names.end()}, {"d", "n", "dn"});
    std::vector<Variant> variants;
    for (const std::string& name : names) variants.push_back({name});
    std::stable_sort(variants.begin(), variants.end(), [](const Variant& a, const Variant& b) {
        return a.planes().size() < b.planes().size();
    });
    return variants;
}

/// Planes of RGB, followed by those of the priors that a variant takes, image by image.
std::vector<float> images_of(const Golden& golden, const std::vector<float>& priors,
                             const Variant& variant) {
    const std::vector<float> rgb = golden.floats("x_rgb");
    const std::size_t pixels = std::size_t{golden.dim("x_rgb", 3)} * golden.dim("x_rgb", 4);
    const std::size_t given = golden.dim("x_prior", 2);
    std::vector<float> all;
    const auto take = [&](const std::vector<float>& from, std::size_t plane) {
        const auto at = from.begin() + static_cast<std::ptrdiff_t>(plane * pixels);
        all.insert(all.end(), at, at + static_cast<std::ptrdiff_t>(pixels));
    };
    for (std::size_t image = 0; image * 3 * pixels < rgb.size(); ++image) {
        for (std::size_t c = 0; c < 3; ++c) take(rgb, 3 * image + c);
        for (const std::size_t plane : variant.planes()) {
            EXPECT_LT(plane, given) << variant.name;
            if (plane < given) take(priors, given * image + plane);
        }
    }
    return all;
}

/// Images before the cameras of a file.
struct GraftInputs {
    GraftInputs(const Golden& golden, std::vector<float> given)
        : images(std::move(given)),
          poses(golden.floats("v2w")),
          quaternions(golden.floats("quat")) {}
    [[nodiscard]] model::ModelInput view() const {
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
    std::unique_ptr<Model> make(const ModelConfig& config, const io::NamedTensors& state,
                                const ModelOptions& options) {
        auto made = need(Model::create(context(), config, options));
        EXPECT_OK(made->init(3));
        EXPECT_OK(made->parameters().zero_gradients());
        model::LoadReport report;
        EXPECT_OK(model::load_state(*made, state, {.source = {}, .graft = true, .take_rays = true},
                                    report));
        return made;
    }
    std::vector<float> get(const vk::BufferView& view) {
        std::vector<float> values(view.shape.elements());
        EXPECT_OK(context().read(view, values.data(), values.size() * 4));
        return values;
    }
    std::vector<std::vector<float>> outputs(Model& model, const model::ModelInput& input) {
        EXPECT_OK(model.set_input(input));
        EXPECT_OK(model.forward());
        const auto views = model.outputs().value();
        return {get(views.means), get(views.opacities), get(views.scales), get(views.rotations),
                get(views.sh)};
    }
    /// The figures of the files, and those of the network of three channels.
    void expect_golden(model::Precision precision);
    void expect_variant(const Golden& golden, const Variant& variant, const ModelOptions& options,
                        const std::vector<std::vector<float>>& expected);
};
SPLAT_INSTANTIATE_KERNELS(GoldenNetGraft);

/// The name of the tensor that changes, and the network's shape, which its state dict tells. The
/// geometry is that of the cars.
std::string first_name(const Golden& golden) {
    return golden.text("first_name");
}

ModelConfig graft_config(const Golden& golden) {
    const std::string enc = "old.network_with_offset.encoder.enc.";
    ModelConfig c;
    c.resolution = golden.dim("x_rgb", 4);
    c.views = golden.dim("x_rgb", 1);
    c.base_dim = golden.dim("old." + first_name(golden), 0);
    c.sh_degree = golden.dim("o_old.features_rest", 2) > 0 ? 1 : 0;
    c.attention_resolutions.clear();
    c.channel_mult.clear();
    for (std::uint32_t r = c.resolution;; r /= 2) {
        const std::string level = enc + std::to_string(r) + "x" + std::to_string(r) + "_block";
        if (!golden.has(level + "0.conv0.weight")) break;
        c.channel_mult.push_back(golden.dim(level + "0.conv0.weight", 0) / c.base_dim);
        if (golden.has(level + "0.qkv.weight")) c.attention_resolutions.push_back(r);
        c.num_blocks = 0;
        while (golden.has(level + std::to_string(c.num_blocks) + ".conv0.weight")) ++c.num_blocks;
    }
    return c;
}

ModelOptions graft_options(const Golden& golden) {
    ModelOptions options;
    options.objects = golden.dim("x_rgb", 0);
    return options;
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
Status put_sum_gradient(vk::Context& context, Model& model) {
    const auto gradients = model.output_gradients().value();
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
    each_golden("graft", [&](const Golden& golden) {
        const io::NamedTensors state = state_of(golden, "old.");
        ModelOptions options = graft_options(golden);
        options.gradients = options.input_gradient = true;
        options.build.precision = precision;
        const auto narrow = make(graft_config(golden), state, options);
        const auto expected = outputs(*narrow, GraftInputs(golden, golden.floats("x_rgb")).view());
        expect_outputs(expected, golden, "o_old.");
        for (const Variant& variant : variants_of(golden))
            expect_variant(golden, variant, options, expected);
    });
}

void GoldenNetGraft::expect_variant(const Golden& golden, const Variant& variant,
                                    const ModelOptions& options,
                                    const std::vector<std::vector<float>>& expected) {
    const std::string at = variant.name;
    const auto wide =
        make(variant.widened(graft_config(golden)), state_of(golden, "old."), options);
    const nn::Parameter& first = *wide->parameters().find(first_name(golden));
    EXPECT_EQ(get(first.value), golden.floats("new_" + at + "." + first.name));
    const auto got = outputs(
        *wide, GraftInputs(golden, images_of(golden, golden.floats("x_prior"), variant)).view());
    expect_outputs(got, golden, "o_" + at + ".");
    for (std::size_t i = 0; i < got.size(); ++i)
        expect_absolute(at + " output " + std::to_string(i), got[i], to_double(expected[i]), 1e-6);
    ASSERT_OK(put_sum_gradient(context(), *wide));
    ASSERT_OK(wide->backward());
    expect_relative("dfirst_" + at, get(first.grad), to_double(golden.floats("dfirst_" + at)),
                    1e-4);
    const std::vector<float> d_x = wide->input_gradient(model::Model::Input::kImages).value();
    expect_relative("d_x_" + at, d_x, to_double(golden.floats("d_x_" + at)), 1e-4);
    const std::size_t planes = 3 + variant.planes().size();
    const std::size_t pixels = std::size_t{golden.dim("x_rgb", 3)} * golden.dim("x_rgb", 4);
    for (std::size_t i = 0; i < d_x.size(); ++i)  // no weight connects to it
        if (i / pixels % planes >= 3) {
            ASSERT_EQ(d_x[i], 0) << at << " " << i;
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

/// Adapters start without effect: those of the file, and ours.
TEST_P(GoldenNetGraft, FreshAdapters) {
    each_golden("graft", [&](const Golden& golden) {
        io::NamedTensors state = state_of(golden, "old.");
        const io::NamedTensors adapters = state_of(golden, "lora_init.");
        ASSERT_GT(adapters.size(), 0U);
        const Variant widest = variants_of(golden).back();
        ModelConfig config = widest.widened(graft_config(golden));
        config.lora.rank = golden.dim("lora_init." + adapters.begin()->name, 0);
        ModelOptions options = graft_options(golden);
        options.build.precision = model::Precision::kStrict;
        const GraftInputs inputs(golden, images_of(golden, golden.floats("x_prior"), widest));
        const auto ours = make(config, state, options);
        const auto expected = outputs(*ours, inputs.view());
        expect_outputs(expected, golden, "o_lora.");
        for (const io::NamedTensor& tensor : adapters) {
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
            ASSERT_OK(state.add(tensor));
        }
        const auto theirs = make(config, state, options);
        EXPECT_EQ(outputs(*theirs, inputs.view()), expected);
    });
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

/// What is trained with the new channels.
enum class Learns { kAll, kAdapters, kBesideAdapters, kFirstAdapter };

struct TrainingCase {
    Variant variant;
    Learns learns;

    /// `first`: the first convolution's weight.
    [[nodiscard]] ModelConfig config(const ModelConfig& narrow, const std::string& first) const {
        ModelConfig c = variant.widened(narrow);
        if (learns == Learns::kAll) return c;
        const std::string layer = first.substr(0, first.rfind('.'));
        c.lora.rank = 4;
        if (learns == Learns::kBesideAdapters) c.lora.trained = {layer + "."};
        if (learns == Learns::kFirstAdapter) c.lora.targets.push_back(layer);
        return c;
    }
    [[nodiscard]] std::string text() const {
        const char* names[] = {"all trained", "adapters only", "trained with adapters",
                               "adapter of the first convolution"};
        return variant.name + ", " + names[static_cast<int>(learns)];
    }
};

/// Eight networks, twenty optimiser steps each: one set of kernels is enough.
class GoldenNetTraining : public GoldenNetGraft {
  protected:
    /// The first convolution's weight, its adapter folded in.
    std::vector<float> first_weight(Model& model, const nn::Parameter& first) {
        const auto state = need(model::save_state(model));
        const auto folded = need(model::merge_adapters(state, state, model.config().lora.alpha, 1));
        return folded.find(first.name)->values;
    }
    void expect_moved(const Golden& golden, const TrainingCase& c,
                      const std::vector<std::vector<float>>& expected);
};
INSTANTIATE_TEST_SUITE_P(Kernels, GoldenNetTraining, testing::Values(vk::Kernels::kCpu),
                         kernels_test_name);

void GoldenNetTraining::expect_moved(const Golden& golden, const TrainingCase& c,
                                     const std::vector<std::vector<float>>& expected) {
    const std::string name = first_name(golden);
    ModelOptions options = graft_options(golden);
    options.gradients = true;
    const auto wide = make(c.config(graft_config(golden), name), state_of(golden, "old."), options);
    const std::vector<float> priors = normal_fill(golden.floats("x_prior").size(), 77);
    const GraftInputs inputs(golden, images_of(golden, priors, c.variant));
    const auto got = outputs(*wide, inputs.view());
    for (std::size_t i = 0; i < got.size(); ++i)
        expect_absolute("output " + std::to_string(i), got[i], to_double(expected[i]), 1e-6);
    const nn::Parameter& first = *wide->parameters().find(name);
    const bool trained = c.learns == Learns::kAll || c.learns == Learns::kBesideAdapters;
    EXPECT_EQ(first.grad.block != nullptr, trained);
    AdamSteps adam(context(), *wide);
    adam.run(20, inputs.view());
    if (testing::Test::HasFatalFailure()) return;
    const std::vector<float> columns = column_sizes(first_weight(*wide, first), first.shape);
    ASSERT_EQ(columns.size(), 3 + c.variant.planes().size());
    for (std::size_t i = 3; i < columns.size(); ++i) {
        // Adam's steps have the size of its rate while gradients keep their signs. In the product of
        // an adapter they are multiplied by numbers of up to 1 / sqrt(9 * 7) and by alpha / rank, 1/4.
        if (trained) {
            EXPECT_GT(columns[i], 5e-3F) << "channel " << i;
        } else if (c.learns == Learns::kFirstAdapter) {
            EXPECT_GT(columns[i], 1e-4F) << "channel " << i;
        } else {
            EXPECT_EQ(columns[i], 0) << "channel " << i;
        }
    }
}

/// From the golden network of three channels to those of every variant: equal outputs, then twenty
/// steps that move the weights of every new channel: alone, with adapters, and by an adapter. They
/// stay unchanged where nothing that sees the channels is trained.
TEST_P(GoldenNetTraining, MovesNewChannels) {
    each_golden("graft", [&](const Golden& golden) {
        const std::vector<Variant> variants = variants_of(golden);
        std::vector<TrainingCase> cases = {{variants.back(), Learns::kAdapters},
                                           {variants.back(), Learns::kFirstAdapter}};
        for (const Variant& variant : variants)
            for (const Learns learns : {Learns::kAll, Learns::kBesideAdapters})
                cases.push_back({variant, learns});
        const auto narrow =
            make(graft_config(golden), state_of(golden, "old."), graft_options(golden));
        const auto expected = outputs(*narrow, GraftInputs(golden, golden.floats("x_rgb")).view());
        for (const TrainingCase& c : cases) {
            SCOPED_TRACE(c.text());
            expect_moved(golden, c, expected);
        }
    });
}

}  // namespace
}  // namespace splat::test
