#include "ops/gaussian_head.h"

#include <gtest/gtest.h>

#include <cmath>

#include "op_samples.h"
#include "ref/gaussian_head_ref.h"
#include "support/golden.h"

namespace splat::test {
namespace {

class GaussianHead : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(GaussianHead);

struct HeadCase {
    std::uint32_t objects = 1;
    std::uint32_t views = 1;
    std::uint32_t height = 3;
    std::uint32_t width = 5;
    std::uint32_t degree = 1;
    bool offset = true;
    bool isotropic = false;
    bool activate = true;
    bool sh_transform = true;
    bool co3d = false;  ///< focals and distances

    [[nodiscard]] OpCall call(std::uint64_t seed) const {
        const std::uint32_t images = objects * views;
        const std::uint32_t channels = 12 + (offset ? 3U : 0U) + (degree == 0 ? 0U : 9U);
        HostTensor matrix = normal_tensor({images, 4, 4}, seed + 2);
        for (std::size_t i = 0; i < matrix.values.size(); i += 16)  // affine, or close to it
            for (const std::size_t at : {3U, 7U, 11U, 15U})
                matrix.values[i + at] = at == 15 ? 1.0F : 0.02F * matrix.values[i + at];
        HostTensor quaternion = normal_tensor({images, 4}, seed + 3);
        for (std::size_t i = 0; i < quaternion.values.size(); i += 4) {
            float square = 0;
            for (std::size_t k = 0; k < 4; ++k)
                square += quaternion.values[i + k] * quaternion.values[i + k];
            for (std::size_t k = 0; k < 4; ++k) quaternion.values[i + k] /= std::sqrt(square);
        }
        HostTensor rays = normal_tensor({3, height, width}, seed + 1);
        std::fill(rays.values.end() - std::ptrdiff_t{height} * width, rays.values.end(), 1.0F);
        const std::uint32_t count = views * height * width;
        return sample(
            "gaussian_head",
            {{"views", views},
             {"znear", 0.5},
             {"zfar", 2.5},
             {"sh_degree", degree},
             {"offset", offset},
             {"isotropic", isotropic},
             {"activate", activate},
             {"sh_transform", sh_transform}},
            {normal_tensor({images, channels, height, width}, seed), rays, matrix, quaternion,
             co3d ? normal_tensor({images, 2}, seed + 4, 40, 3) : HostTensor{},
             co3d ? normal_tensor({images, height, width}, seed + 5, 8) : HostTensor{}},
            {Shape{objects, count, 3}, Shape{objects, count, 1}, Shape{objects, count, 3},
             Shape{objects, count, 4}, Shape{objects, count, degree == 0 ? 1U : 4U, 3}});
    }
    [[nodiscard]] ref::GaussianHeadInput<double> reference(const OpCall& call) const {
        ref::GaussianHeadInput<double> in;
        in.images = std::size_t{objects} * views;
        in.pixels = std::size_t{height} * width;
        in.sh_degree = degree;
        in.offset = offset;
        in.isotropic = isotropic;
        in.activate = activate;
        in.sh_transform = sh_transform;
        in.znear = 0.5;
        in.zfar = 2.5;
        std::vector<double>* const members[] = {&in.net_out,    &in.rays,  &in.view_to_world,
                                                &in.quaternion, &in.focal, &in.distance};
        for (std::size_t i = 0; i < 6; ++i) *members[i] = to_double(call.inputs[i].values);
        return in;
    }
};

std::vector<HeadCase> head_cases() {
    return {{},
            {.objects = 2, .views = 2, .height = 4, .width = 4},
            {.height = 17, .width = 9, .degree = 0},
            {.offset = false},
            {.objects = 3, .degree = 0, .offset = false},
            {.isotropic = true},
            {.isotropic = true, .activate = false},
            {.activate = false, .sh_transform = false},
            {.objects = 2, .co3d = true}};
}

ref::GaussianHeadArrays<double> grads_of(const OpCall& call) {
    ref::GaussianHeadArrays<double> grads;
    for (std::size_t i = 0; i < 5; ++i) grads[i] = to_double(call.grad_outputs[i].values);
    return grads;
}

TEST_P(GaussianHead, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const HeadCase& c : head_cases()) {
        const OpCall call = c.call(seed += 20);
        const auto input = c.reference(call);
        expect_matches(context(), call, ref::gaussian_head_forward(input),
                       {ref::gaussian_head_backward(input, grads_of(call))},
                       call.attributes.dump());
    }
}

/// The predictor's outputs in golden/net, from its last convolution's.
TEST_P(GaussianHead, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    for (const std::string& path : golden_files("net", "net_")) {
        const auto file = Npz::read(path);
        ASSERT_OK(file.status());
        const Npz& npz = file.value();
        const std::vector<double> cfg = golden_integers(npz, "cfg");
        const std::vector<double> cfgf = golden_values(npz, "cfgf");
        const HostTensor net = golden_tensor(npz, "net_out");
        const auto images = net.shape[0];
        const auto height = net.shape[2];
        const auto width = net.shape[3];
        HostTensor rays = golden_tensor(npz, "ray_dirs");
        rays.shape = {3, height, width};
        HostTensor matrix = golden_tensor(npz, "v2w");
        matrix.shape = {images, 4, 4};
        HostTensor quaternion = golden_tensor(npz, "quat");
        quaternion.shape = {images, 4};
        HostTensor focal;
        HostTensor distance;
        if (npz.has("focal")) {  // CO3D: the last input channel is the distance of the origin
            focal = golden_tensor(npz, "focal");
            focal.shape = {images, 2};
            const HostTensor x = golden_tensor(npz, "x");
            const std::size_t pixels = std::size_t{height} * width;
            const std::size_t channels = x.values.size() / images / pixels;
            distance.shape = {images, height, width};
            for (std::size_t i = 0; i < images * pixels; ++i)
                distance.values.push_back(
                    x.values[(i / pixels * channels + channels - 1) * pixels + i % pixels]);
        }
        for (const bool activate : {true, false}) {
            OpCall call;
            call.op = "gaussian_head";
            call.attributes = {{"views", static_cast<int>(cfg[5])},
                               {"znear", cfgf[0]},
                               {"zfar", cfgf[1]},
                               {"sh_degree", static_cast<int>(cfg[4])},
                               {"isotropic", cfg[7] != 0},
                               {"activate", activate}};
            call.inputs = {net, rays, matrix, quaternion, focal, distance};
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status) << path;
            const auto check = [&](const std::vector<float>& got, const std::string& name) {
                EXPECT_TRUE(close(got, golden_values(npz, name), kGoldenLayer, kGoldenLayer,
                                  {name, reproduce(path)}));
            };
            if (!activate) {
                if (!npz.has("raw.opacity")) continue;
                check(gpu.outputs[1], "raw.opacity");
                check(gpu.outputs[2], "raw.scaling");
                continue;
            }
            check(gpu.outputs[0], "o.xyz");
            check(gpu.outputs[1], "o.opacity");
            check(gpu.outputs[2], "o.scaling");
            check(gpu.outputs[3], "o.rotation");
            std::vector<float> dc;
            std::vector<float> rest;
            const std::size_t per_pixel = cfg[4] > 0 ? 12 : 3;
            for (std::size_t i = 0; i < gpu.outputs[4].size(); ++i)
                (i % per_pixel < 3 ? dc : rest).push_back(gpu.outputs[4][i]);
            check(dc, "o.features_dc");
            if (cfg[4] > 0) check(rest, "o.features_rest");
        }
    }
}

TEST_P(GaussianHead, ZeroQuaternionsStayFinite) {
    const HeadCase c;
    OpCall call = c.call(300);
    std::fill(call.inputs[0].values.begin(), call.inputs[0].values.end(), 0.0F);
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[3][0], 0);
    EXPECT_TRUE(all_finite(gpu.grad_inputs[0], {"grad_net_out", reproduce("zero")}));
}

TEST_P(GaussianHead, RejectsBadShapes) {
    const auto status = [&](const auto& change) {
        OpCall call = HeadCase{.objects = 2, .views = 2, .co3d = true}.call(400);
        call.grad_outputs.clear();
        change(call);
        return run_op(context(), call).status;
    };
    EXPECT_OK(status([](OpCall&) {}));
    const char* const names[] = {"'net_out'",    "'rays'",  "'view_to_world'",
                                 "'quaternion'", "'focal'", "'distance'"};
    for (std::size_t i = 0; i < 6; ++i)
        EXPECT_ERROR(status([&](OpCall& c) {
                         c.inputs[i] = normal_tensor({4, 3, 3, 1}, 1);
                     }),
                     Code::kShape, names[i]);
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["views"] = 3; }), Code::kInvalidArgument,
                 "views");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["sh_degree"] = 2; }), Code::kInvalidArgument,
                 "sh_degree");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["offset"] = false; }), Code::kShape,
                 "'net_out'");
}

TEST(GaussianHeadReference, GradcheckFloat64) {
    std::uint64_t seed = 500;
    for (const HeadCase& c : head_cases()) {
        if (c.height > 4) continue;  // the same code, more pixels
        const OpCall call = c.call(seed += 20);
        const auto input = c.reference(call);
        const auto grads = grads_of(call);
        expect_gradcheck({input.net_out},
                         [&](const Arrays& in) {
                             auto changed = input;
                             changed.net_out = in[0];
                             Arrays out;
                             for (const auto& array : ref::gaussian_head_forward(changed))
                                 out.push_back(array.value);
                             return out;
                         },
                         {grads.begin(), grads.end()},
                         {ref::gaussian_head_backward(input, grads).value});
    }
}

}  // namespace
}  // namespace splat::test
