#include "ops/gaussian_head.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "ref/gaussian_head_ref.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

class GaussianHead : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(GaussianHead);

/// Which optional tensors a head's call has, and whether its matrices are perspective.
struct HeadCameras {
    bool focal;
    bool origin;
    bool projective;
};

/// A call of gaussian_head with cameras at random: `images` is [images, height, width].
OpCall head_sample(const Shape& images, std::uint32_t views, const HeadForm& form,
                   const HeadCameras& with, std::uint64_t seed) {
    const HeadLayout layout(form);
    const std::uint32_t n = images[0];
    const std::uint32_t batch = n / views;
    const std::uint32_t each = views * images[1] * images[2] * form.per_pixel;
    HostTensor rays = normal_tensor({3, images[1], images[2]}, seed + 1, 0, with.focal ? 40 : 0.5);
    std::fill(rays.values.end() - images[1] * images[2], rays.values.end(), 1.0F);
    HostTensor matrices = normal_tensor({n, 4, 4}, seed + 2);
    for (std::size_t i = 3; i < matrices.values.size(); i += 4) {  // the column that gives w
        const float w = i % 16 == 15 ? 1.0F : 0.0F;
        matrices.values[i] = with.projective ? 4 * w + 0.2F * matrices.values[i] : w;
    }
    Json attributes;
    for (const JsonScalar& attribute : ops::gaussian_head_attributes(form, views))
        std::visit([&](const auto& value) { attributes[attribute.name] = value; }, attribute.value);
    OpCall call = sample("gaussian_head", attributes,
                         {normal_tensor({n, layout.channels(), images[1], images[2]}, seed),
                          rays,
                          matrices,
                          normal_tensor({n, 4}, seed + 3),
                          normal_tensor({n, 2}, seed + 4, 40, 2),
                          {}},
                         {Shape{batch, each, 3},
                          {batch, each, 1},
                          {batch, each, 3},
                          {batch, each, 4},
                          {batch, each, layout.coefficients(), 3}});
    if (!with.focal) call.inputs[4] = {};
    if (form.positions == kHeadInputDepth)
        call.inputs[5] = normal_tensor(images, seed + 5, 2, 0.1);
    else if (with.origin)
        call.inputs[5] = normal_tensor({n}, seed + 5, 2, 0.1);
    return call;
}

struct HeadCase {
    Shape images;  ///< [images, height, width]
    std::uint32_t views;
    HeadForm form;
    HeadCameras cameras;
};

constexpr HeadCameras kAll{true, true, true};
constexpr HeadCameras kNone{false, false, false};

/// Every attribute both ways, one pixel and odd numbers of them, focal and origin together and alone; the last are
/// heads of other networks, F3D-Gaus and LGM, and several Gaussians of a pixel.
std::vector<HeadCase> head_cases() {
    const HeadForm lgm{.positions = kHeadBox,
                       .least = -1,
                       .most = 1,
                       .scales = kHeadSoftplus,
                       .sh_degree = 0,
                       .direct = true};
    HeadForm raw = lgm;
    raw.activate = false;
    raw.per_pixel = 2;
    return {
        {{1, 1, 1}, 1, {}, kNone},
        {{4, 5, 7}, 2, {}, kAll},
        {{3, 3, 5}, 3, {.isotropic = true, .sh_degree = 0}, {true, false, false}},
        {{3, 9, 2}, 1, {.offset = false, .isotropic = true}, {false, true, false}},
        {{2, 1, 65}, 1, {.offset = false, .sh_degree = 0, .activate = false}, {false, false, true}},
        {{5, 16, 16}, 5, {.isotropic = true, .activate = false}, kNone},
        {{2, 33, 31}, 1, {}, kAll},
        {{2, 5, 3}, 2, {.positions = kHeadInputDepth}, kAll},
        {{2, 3, 5}, 1, {.positions = kHeadInputDepth, .offset = false, .per_pixel = 2}, kNone},
        {{4, 5, 7}, 4, lgm, kAll},
        {{2, 7, 3}, 1, raw, kNone},
        {{2, 5, 3}, 1, {.positions = kHeadBox, .scales = kHeadSoftplus, .per_pixel = 3}, kAll},
        {{2, 3, 7}, 2, {.scales = kHeadSoftplus, .isotropic = true, .per_pixel = 4}, kAll},
        {{1, 4, 5}, 1, {.sh_degree = 0, .direct = true, .per_pixel = 3}, kAll}};
}

/// The same and more sizes, with alternating attributes.
std::vector<HeadCase> sized_head_cases() {
    std::vector<HeadCase> cases = head_cases();
    const std::uint32_t sizes[][2] = {{1, 2},  {2, 1},   {3, 3},   {1, 17},  {17, 1},  {15, 17},
                                      {7, 9},  {8, 8},   {1, 63},  {64, 1},  {5, 13},  {1, 127},
                                      {43, 3}, {16, 17}, {255, 1}, {1, 257}, {64, 64}, {4, 5}};
    for (const auto& [height, width] : sizes) {
        const auto i = static_cast<std::uint32_t>(cases.size());
        const std::uint32_t views = 1 + i % 2;
        cases.push_back({{views * (1 + i % 3), height, width},
                         views,
                         {.offset = i % 4 != 0,
                          .isotropic = i % 5 == 0,
                          .sh_degree = i % 3 == 0 ? 0U : 1U,
                          .activate = i % 7 != 0},
                         {i % 2 == 0, i % 3 == 1, i % 5 == 2}});
    }
    EXPECT_GE(cases.size(), 24U);
    return cases;
}

OpCall call_of(const HeadCase& c, std::uint64_t seed) {
    return head_sample(c.images, c.views, c.form, c.cameras, seed);
}

TEST_P(GaussianHead, MatchesFloat64) {
    std::uint64_t seed = 100;
    for (const HeadCase& c : sized_head_cases())
        expect_float64(context(), call_of(c, seed += 20), c.images.text());
}

TEST_P(GaussianHead, RotationsNearZeroStayFinite) {
    OpCall call = call_of(head_cases()[1], 300);
    const std::size_t pixels = 35;
    for (std::size_t c = 8; c < 12; ++c)
        for (std::size_t i = 0; i < 3; ++i) {
            const float tiny[] = {0, 1e-14F, 1e-8F};
            call.inputs[0].values[c * pixels + i] = tiny[i];
        }
    expect_float64(context(), call, "rotations near zero");
}

TEST_P(GaussianHead, MatchesFloat64WhereSquaresOfRotationsOverflow) {
    OpCall call = call_of(head_cases()[1], 310);
    const std::size_t pixels = 35;
    for (std::size_t i = 0; i < call.inputs[0].values.size(); ++i) {
        const std::size_t channel = i / pixels % call.inputs[0].shape[1];
        if (channel >= 8 && channel < 12) call.inputs[0].values[i] *= i % 2 == 0 ? 1e20F : 1e30F;
    }
    expect_float64(context(), call, "long rotations");
}

TEST_P(GaussianHead, ExtremesStayFinite) {
    OpCall call = call_of(head_cases()[1], 320);
    for (float& value : call.inputs[0].values) value *= 30;  // exp(88) is the greatest there is
    for (float& value : call.inputs[0].values) value = std::clamp(value, -80.0F, 80.0F);
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    for (const auto& output : gpu.outputs) EXPECT_TRUE(all_finite(output, {"output", "x 30"}));
    EXPECT_TRUE(all_finite(gpu.grad_inputs[0], {"grad_net_out", "x 30"}));
}

/// A number that is not finite stays one, so that it is counted and drawn nowhere.
TEST_P(GaussianHead, NoNumberComesOfNaN) {
    OpCall call = call_of(head_cases()[1], 330);
    const std::size_t pixels = 35, opacity = 4;
    call.inputs[0].values[0] = std::numeric_limits<float>::quiet_NaN();
    call.inputs[0].values[opacity * pixels + 1] = std::numeric_limits<float>::quiet_NaN();
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    EXPECT_TRUE(std::isnan(gpu.outputs[0][0])) << "mean of pixel 0";
    EXPECT_TRUE(std::isnan(gpu.outputs[1][1])) << "opacity of pixel 1";
    EXPECT_TRUE(std::isfinite(gpu.outputs[0][3]));
}

/// Activations far from 0 and at the bounds of a box: both directions, and what is small keeps its digits.
TEST_P(GaussianHead, LimitsOfActivations) {
    const HeadForm lgm{.positions = kHeadBox,
                       .least = -1,
                       .most = 1,
                       .scales = kHeadSoftplus,
                       .sh_degree = 0,
                       .direct = true};
    const float values[] = {0, 1e-6F, -1e-6F, 1,   -1, 1.0000001F, -1.0000001F,
                            8, -8,    20,     -20, 40, -40};
    const HeadForm forms[] = {lgm, {}, {.positions = kHeadInputDepth, .isotropic = true}};
    for (const HeadForm& form : forms) {
        const HeadLayout layout(form);
        OpCall call = head_sample({1, 1, std::size(values)}, 1, form, kNone, 345);
        for (std::size_t i = 0; i < call.inputs[0].values.size(); ++i) {
            float& value = call.inputs[0].values[i];
            value = values[(i + i / std::size(values)) % std::size(values)];
            const std::size_t channel = i / std::size(values);
            const bool scale =
                channel >= layout.at(kHeadScale) && channel < layout.at(kHeadRotation);
            if (scale && form.scales == kHeadExp)
                value = std::min(value, 8.0F);  // e^8 is 3000 units
        }
        expect_float64(context(), call, format("limits of head %u", form.positions));
    }
}

TEST_P(GaussianHead, RejectsWhatDoesNotFit) {
    const OpCall good = call_of(head_cases()[1], 340);
    const auto status = [&](const auto& change) {
        OpCall call = good;
        change(call);
        return run_op(context(), call).status;
    };
    EXPECT_OK(status([](OpCall&) {}));
    const auto with = [&](const char* name, const Json& value) {
        return status([&](OpCall& c) { c.attributes[name] = value; });
    };
    EXPECT_ERROR(with("sh_degree", 2), Code::kInvalidArgument, "sh_degree is 2");
    EXPECT_ERROR(with("sh_degree", 0), Code::kShape, "expected 15");
    EXPECT_ERROR(with("offset", false), Code::kShape, "expected 21");
    EXPECT_ERROR(with("views", 3), Code::kShape, "objects of 3 views");
    EXPECT_ERROR(with("views", 0), Code::kInvalidArgument, "views is 0");
    EXPECT_ERROR(with("znear", 5), Code::kInvalidArgument, "znear is 5");
    EXPECT_ERROR(with("positions", 3), Code::kInvalidArgument, "positions is 3");
    EXPECT_ERROR(with("positions", 1), Code::kShape, "expected 23, for each of 1 Gaussians");
    EXPECT_ERROR(with("scales", 1), Code::kInvalidArgument, "scales is 1");
    EXPECT_ERROR(with("per_pixel", 5), Code::kInvalidArgument, "per_pixel is 5");
    EXPECT_ERROR(with("direct", true), Code::kInvalidArgument, "expected 0 with direct colours");
    OpCall without_depth = call_of(head_cases()[8], 350);
    without_depth.inputs[5] = {};
    EXPECT_ERROR(run_op(context(), without_depth).status, Code::kShape, "origin");
    for (std::size_t i = 1; i < 6; ++i)
        EXPECT_ERROR(status([&](OpCall& c) { c.inputs[i] = normal_tensor({9}, 1); }), Code::kShape,
                     ops::find_op("gaussian_head").value()->inputs[i].name);
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[0] = normal_tensor({24, 35}, 1);
                 }),
                 Code::kShape, "net_out");
}

/// Callers of the host function, who pass no row of the table.
TEST_P(GaussianHead, ChecksItsLayout) {
    const auto refused = [&](const HeadForm& form, const char* message) {
        ops::GaussianHeadDesc desc;
        desc.layout = HeadLayout(form);
        desc.channels = desc.layout.channels();
        EXPECT_ERROR(ops::gaussian_head_check(desc), Code::kInvalidArgument, message);
    };
    refused({.positions = kHeadBox + 1}, "positions is 3, expected 0 to 2");
    refused({.scales = kHeadSigmoid}, "scales is 1, expected 2 to 3");
    refused({.scales = kHeadTanh}, "scales is 4");
    refused({.sh_degree = 2}, "sh_degree is 2");
    refused({.per_pixel = 0}, "per_pixel is 0");
    refused({.per_pixel = 5}, "per_pixel is 5, expected 1 to 4");
    ops::GaussianHeadDesc desc;
    desc.layout = HeadLayout({.positions = kHeadInputDepth});
    desc.channels = desc.layout.channels();
    EXPECT_OK(ops::gaussian_head_check(desc));
    vk::Recorder recorder(context());
    EXPECT_ERROR(ops::gaussian_head_forward(recorder, desc, {}, {}, {}), Code::kInvalidArgument,
                 "needs origin");
    EXPECT_ERROR(ops::gaussian_head_backward(recorder, desc, {}, {}, {}, {}),
                 Code::kInvalidArgument, "needs origin");
}

TEST(GaussianHeadReference, GradcheckFloat64) {
    std::uint64_t seed = 400;
    for (HeadCase c : head_cases()) {
        if (c.images[1] > 8) c.images = {c.images[0], 2, 3};
        const OpCall call = call_of(c, seed += 20);
        const ref::GaussianHeadInput in = ref::head_input(arguments_of(call));
        ref::GaussianHeadOutputs<double> grads;
        for (std::size_t i = 0; i < grads.size(); ++i)
            grads[i] = to_double(call.grad_outputs[i].values);
        const auto forward = [&](const Arrays& inputs) {
            ref::GaussianHeadInput changed = in;
            changed.net_out = inputs[0];
            const auto out = ref::gaussian_head_forward<double>(changed);
            return Arrays(out.begin(), out.end());
        };
        expect_gradcheck({in.net_out}, forward, Arrays(grads.begin(), grads.end()),
                         {ref::gaussian_head_backward<double>(in, grads)});
    }
}

/// The heads of whole networks. The float32 output of the network is the input here, so the results
/// carry its rounding too.
constexpr double kGoldenHead = 2e-5;

HostTensor reshaped(HostTensor tensor, const Shape& shape) {
    EXPECT_EQ(tensor.shape.elements(), shape.elements());
    tensor.shape = shape;
    return tensor;
}

OpCall golden_call(const Golden& golden) {
    const std::vector<std::int64_t> cfg = golden.array("cfg").ints().value();
    const std::vector<double> depths = golden.doubles("cfgf");
    const auto tensor = [&](const char* name) { return golden_tensor(golden.npz, name); };
    const HostTensor net_out = tensor("net_out");
    const std::uint32_t images = net_out.shape[0];
    const std::uint32_t height = net_out.shape[2];
    const std::uint32_t width = net_out.shape[3];
    const auto views = static_cast<std::uint32_t>(cfg.at(5));
    const std::uint32_t batch = images / views;
    const std::uint32_t each = views * height * width;
    OpCall call;
    call.op = "gaussian_head";
    call.attributes = {{"views", views},
                       {"sh_degree", cfg[4]},
                       {"znear", depths[0]},
                       {"zfar", depths[1]},
                       {"isotropic", cfg[7] != 0}};
    call.inputs = {net_out,
                   reshaped(tensor("ray_dirs"), {3, height, width}),
                   reshaped(tensor("v2w"), {images, 4, 4}),
                   reshaped(tensor("quat"), {images, 4}),
                   {},
                   {}};
    if (golden.has("focal")) {  // then the last channel holds the distance, one number per image
        call.inputs[4] = reshaped(tensor("focal"), {images, 2});
        const HostTensor x = tensor("x");
        call.inputs[5] = {{images}, {}};
        for (std::uint32_t i = 1; i <= images; ++i)
            call.inputs[5].values.push_back(x.values[x.values.size() / images * i - 1]);
    }
    const HostTensor dc = tensor("g.features_dc");
    const auto coefficients = static_cast<std::uint32_t>(1 + 3 * cfg[4]);
    HostTensor sh{{batch, each, coefficients, 3}, {}};
    const std::vector<float> rest =
        coefficients > 1 ? tensor("g.features_rest").values : std::vector<float>{};
    for (std::size_t g = 0; g < std::size_t{batch} * each; ++g) {
        for (std::size_t i = 0; i < 3; ++i) sh.values.push_back(dc.values[3 * g + i]);
        for (std::size_t i = 0; i < 9 && !rest.empty(); ++i) sh.values.push_back(rest[9 * g + i]);
    }
    call.grad_outputs = {tensor("g.xyz"), tensor("g.opacity"), tensor("g.scaling"),
                         tensor("g.rotation"), sh};
    return call;
}

/// dc and the rest of the golden file, as the operator orders them.
std::vector<double> golden_sh(const Golden& golden, std::size_t coefficients) {
    const std::vector<double> dc = golden.doubles("o64.features_dc");
    if (coefficients == 1) return dc;
    const std::vector<double> rest = golden.doubles("o64.features_rest");
    std::vector<double> sh;
    for (std::size_t g = 0; g < dc.size() / 3; ++g) {
        for (std::size_t i = 0; i < 3; ++i) sh.push_back(dc[3 * g + i]);
        for (std::size_t i = 0; i < 9; ++i) sh.push_back(rest[9 * g + i]);
    }
    return sh;
}

void expect_golden(vk::Context& context, const Golden& golden) {
    const std::string& path = golden.name;
    const OpCall call = golden_call(golden);
    const OpResult gpu = run_op(context, call);
    ASSERT_OK(gpu.status) << path;
    const char* const names[] = {"xyz", "opacity", "scaling", "rotation"};
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_TRUE(close(gpu.outputs[i], golden.doubles(std::string("o64.") + names[i]),
                          kGoldenHead, kGoldenHead, {names[i], reproduce(path)}));
    EXPECT_TRUE(close(gpu.outputs[4], golden_sh(golden, call.grad_outputs[4].shape[2]), kGoldenHead,
                      kGoldenHead, {"sh", reproduce(path)}));
    if (!golden.has("d.network_with_offset.out.bias")) return;
    // The gradient of the last convolution's bias is the sum over images and pixels of grad_net_out.
    const Shape& shape = call.inputs[0].shape;
    const std::size_t pixels = std::size_t{shape[2]} * shape[3];
    std::vector<double> sums(shape[1], 0);
    std::vector<double> magnitudes(shape[1], 0);
    for (std::size_t i = 0; i < gpu.grad_inputs[0].size(); ++i) {
        const auto gradient = static_cast<double>(gpu.grad_inputs[0][i]);
        sums[i / pixels % shape[1]] += gradient;
        magnitudes[i / pixels % shape[1]] += std::abs(gradient);
    }
    const std::vector<double> bias = golden.doubles("d.network_with_offset.out.bias");
    for (std::size_t c = 0; c < bias.size(); ++c)
        EXPECT_NEAR(sums[c], bias[c], kGoldenHead * magnitudes[c]) << path << " channel " << c;
}

TEST_P(GaussianHead, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("net_", [&](const Golden& golden) { expect_golden(context(), golden); });
}

TEST_P(GaussianHead, GoldenNetRaw) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("net_rgb", [&](const Golden& golden) {
        OpCall call = golden_call(golden);
        call.attributes["activate"] = false;
        const OpResult gpu = run_op(context(), call);
        ASSERT_OK(gpu.status) << golden.name;
        EXPECT_TRUE(close(gpu.outputs[1], golden.doubles("raw.opacity"), 0, 0,
                          {"opacities", reproduce(golden.name)}));
        EXPECT_TRUE(close(gpu.outputs[2], golden.doubles("raw.scaling"), 0, 0,
                          {"scales", reproduce(golden.name)}));
    });
}

}  // namespace
}  // namespace splat::test
