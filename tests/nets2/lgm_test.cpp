// LGM's network against golden/nets2/lgm_*.npz, which its published code computed in float64; see INDEX.md there.
#include <gtest/gtest.h>

#include "gaussians/gaussian_set.h"
#include "model/weights.h"
#include "ops/op_harness.h"
#include "scene/sh.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

using model::Model;

/// Relative L2 per tensor.
constexpr double kOutput = 5e-6;
constexpr double kGradient = 2e-5;

std::vector<std::uint32_t> list_of(const Golden& golden, const char* key) {
    const NpyArray& array = golden.array(key);
    std::vector<std::uint32_t> list;
    if (array.dtype == "b1") {
        for (const auto byte : array.bytes) list.push_back(static_cast<std::uint32_t>(byte));
        return list;
    }
    const auto numbers = need(array.ints());
    for (const std::int64_t one : numbers) list.push_back(static_cast<std::uint32_t>(one));
    return list;
}

model::ModelConfig config_of(const Golden& golden) {
    model::ModelConfig c;
    c.network = config::Network::kLgmUnet;
    c.lgm = {list_of(golden, "down_channels"), list_of(golden, "up_channels"),
             list_of(golden, "down_attention"), list_of(golden, "up_attention")};
    c.views = golden.dim("input", 1);
    c.resolution = golden.dim("input", 3);
    c.positions = kHeadBox;
    c.scales = kHeadSoftplus;
    c.direct = true;
    c.sh_degree = 0;
    return c;
}

io::NamedTensors state_of(const Golden& golden) {
    const std::string start = "state.";
    io::NamedTensors state;
    for (const std::string& name : golden.npz.names())
        if (name.starts_with(start)) {
            EXPECT_OK(state.add({name.substr(start.size()), golden.dims(name), io::NumberType::kF32,
                                 golden.floats(name)}));
        }
    return state;
}

/// Columns `first` to `first + count` of rows [N,14].
template <class Real>
std::vector<Real> columns(const std::vector<Real>& rows, std::size_t first, std::size_t count) {
    std::vector<Real> taken;
    for (std::size_t at = 0; at < rows.size(); at += 14)
        for (std::size_t i = first; i < first + count; ++i) taken.push_back(rows[at + i]);
    return taken;
}

/// A part of a row of the published code's Gaussians, and how ours follows from it.
struct Part {
    const char* name;
    std::size_t first, count;
    vk::BufferView Model::Outputs::*view;
    std::vector<double> scales;  ///< ours = scale * (theirs + shift)
    double shift = 0;
    [[nodiscard]] double scale(std::size_t i) const { return scales[i % count]; }
};
/// The published axes are right, up and back; those of scenes are right, down and front.
const std::vector<double> kColour(3, 1 / scene::kSh0);
const Part kParts[] = {{"means", 0, 3, &Model::Outputs::means, {1, -1, -1}},
                       {"opacities", 3, 1, &Model::Outputs::opacities, {1}},
                       {"scales", 4, 3, &Model::Outputs::scales, {1, 1, 1}},
                       {"rotations", 7, 4, &Model::Outputs::rotations, {1, 1, -1, -1}},
                       {"colours", 11, 3, &Model::Outputs::sh, kColour, -0.5}};

class Nets2 : public KernelsTest {
  protected:
    void SetUp() override {
        SPLAT_NEEDS_GOLDEN_FOLDER();
        KernelsTest::SetUp();
    }
    [[nodiscard]] std::vector<float> get(const vk::BufferView& view) const {
        std::vector<float> values(view.shape.elements());
        EXPECT_OK(context().read(view, values.data(), values.size() * sizeof(float)));
        return values;
    }
    void run(const Golden& golden) const;
    void expect_outputs(const Golden& golden, Model& model) const;
    void expect_gradients(const Golden& golden, Model& model) const;
};
SPLAT_INSTANTIATE_KERNELS(Nets2);

void Nets2::expect_outputs(const Golden& golden, Model& model) const {
    expect_relative(golden.name + " raw", get(model.raw_output()), golden.doubles("raw"), kOutput);
    const Model::Outputs outputs = need(model.outputs());
    for (const Part& part : kParts) {
        std::vector<float> got = get(outputs.*part.view);
        for (std::size_t i = 0; i < got.size(); ++i)
            got[i] = static_cast<float>(static_cast<double>(got[i]) / part.scale(i) - part.shift);
        expect_relative(golden.name + " " + part.name, got,
                        columns(golden.doubles("gaussians"), part.first, part.count), kOutput);
    }
}

void Nets2::expect_gradients(const Golden& golden, Model& model) const {
    const Model::Outputs gradients = need(model.output_gradients());
    for (const Part& part : kParts) {
        std::vector<float> values =
            columns(golden.floats("grad_gaussians"), part.first, part.count);
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = static_cast<float>(static_cast<double>(values[i]) / part.scale(i));
        ASSERT_OK(
            context().write(gradients.*part.view, values.data(), values.size() * sizeof(float)));
    }
    ASSERT_OK(model.backward());
    std::size_t compared = 0;
    const auto norm = [](const std::vector<double>& values) {
        double sum = 0;
        for (const double value : values) sum += value * value;
        return std::sqrt(sum);
    };
    const double largest = norm(golden.doubles("grad.conv.bias"));
    for (const nn::Parameter& parameter : model.parameters().all())
        if (const std::string key = "grad." + parameter.name; golden.has(key)) {
            const std::vector<double> expected = golden.doubles(key);
            // Normalised with its own channel alone, a bias has no influence: float64 left its roundings.
            if (norm(expected) < 1e-12 * largest)
                expect_absolute(golden.name + " " + key, get(parameter.grad), expected,
                                kGradient * largest);
            else
                expect_relative(golden.name + " " + key, get(parameter.grad), expected, kGradient);
            ++compared;
        }
    const std::vector<std::string> names = golden.npz.names();
    const auto given = static_cast<std::size_t>(std::ranges::count_if(
        names, [](const std::string& name) { return name.starts_with("grad."); }));
    EXPECT_EQ(compared + 1, given) << "every gradient of the file except the input's";
    expect_relative(golden.name + " grad.input", need(model.input_gradient(Model::Input::kImages)),
                    golden.doubles("grad.input"), kGradient);
}

void Nets2::run(const Golden& golden) const {
    model::ModelOptions options;
    options.gradients = options.input_gradient = true;
    options.build.precision = model::Precision::kStrict;
    const auto made = need(Model::create(context(), config_of(golden), options));
    model::LoadReport report;
    ASSERT_OK(model::load_state(*made, state_of(golden), {}, report));
    ASSERT_OK(made->parameters().zero_gradients());
    const model::IdentityPoses poses(made->config().views);
    const std::vector<float> images = golden.floats("input");
    ASSERT_OK(made->set_input({.images = images,
                               .view_to_world = poses.view_to_world,
                               .quaternions = poses.quaternions,
                               .focals = {},
                               .embedding = {},
                               .tokens = {}}));
    ASSERT_OK(made->forward());
    expect_outputs(golden, *made);
    expect_gradients(golden, *made);
}

TEST_P(Nets2, LgmGivesWhatItsCodeDid) {
    for (const std::string& path : golden_files("nets2", "lgm_")) {
        auto npz = need(Npz::read(path));
        run({std::move(npz), golden_name(path), false});
        if (HasFatalFailure()) return;
    }
}

}  // namespace
}  // namespace splat::test
