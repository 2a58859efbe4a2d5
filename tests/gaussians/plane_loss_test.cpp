#include "gaussians/plane_loss.h"

#include <gtest/gtest.h>

#include "ref/losses/plane_loss_ref.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/gradcheck.h"

namespace splat::test {
namespace {

using ref::kPackedGaussian;
using ref::PlaneLossInput;

class PlaneLoss : public testing::TestWithParam<vk::Kernels> {
  protected:
    [[nodiscard]] static vk::Context& context() { return *shared_context(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(Kernels, PlaneLoss, testing::ValuesIn(kernels_to_test()),
                         [](const auto& of) { return std::string(vk::kernels_name(of.param)); });

/// Gaussians near planes 1.3 away, `sizes` of them on each and 7 on none, in no order.
PlaneLossInput make_input(const std::vector<std::size_t>& sizes, std::uint64_t seed,
                          double thickness = 0.05) {
    PlaneLossInput in;
    Rng rng(seed);
    const auto unit = [&](auto& v) {
        double size = 0;
        for (double& x : v) {
            x = rng.normal();
            size += x * x;
        }
        for (double& x : v) x = static_cast<double>(static_cast<float>(x / std::sqrt(size)));
    };
    in.gaussians = 7;
    for (const std::size_t size : sizes) in.gaussians += size;
    std::vector<std::size_t> numbers(in.gaussians);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        numbers[i] = i;
        std::swap(numbers[i], numbers[rng.below(i + 1)]);
    }
    in.packed.resize(kPackedGaussian * in.gaussians);
    for (std::size_t i = 0; i < in.gaussians; ++i) {
        double* const g = &in.packed[kPackedGaussian * i];
        for (std::size_t k = 0; k < 3; ++k) {
            g[k] = static_cast<double>(static_cast<float>(rng.normal()));
            g[4 + k] = static_cast<double>(static_cast<float>(0.01 + 0.1 * rng.uniform()));
        }
        g[3] = 0.5;
        std::array<double, 4> q{};
        unit(q);
        std::copy(q.begin(), q.end(), g + 8);
    }
    for (const std::size_t size : sizes) {
        ref::Vec3<double>& n = in.normals.emplace_back();
        unit(n);
        std::vector<std::size_t>& members = in.members.emplace_back();
        for (std::size_t i = 0; i < size; ++i) {
            members.push_back(numbers.back());
            numbers.pop_back();
            double* const mean = &in.packed[kPackedGaussian * members.back()];
            const double along = n[0] * mean[0] + n[1] * mean[1] + n[2] * mean[2];
            const double by = 1.3 + thickness * rng.normal() - along;
            for (std::size_t k = 0; k < 3; ++k)
                mean[k] = static_cast<double>(static_cast<float>(mean[k] + by * n[k]));
        }
    }
    return in;
}

struct Computed {
    std::vector<float> loss, grad;
};

/// Gradients are added to ones.
Computed compute(vk::Context& context, const PlaneLossInput& in, float grad_loss) {
    std::vector<std::uint32_t> members, begins{0};
    std::vector<float> normals;
    for (std::size_t p = 0; p < in.members.size(); ++p) {
        members.insert(members.end(), in.members[p].begin(), in.members[p].end());
        begins.push_back(static_cast<std::uint32_t>(members.size()));
        for (const double x : in.normals[p]) normals.push_back(static_cast<float>(x));
        normals.push_back(0);
    }
    members.resize(in.gaussians, ~0U);
    const auto planes = static_cast<std::uint32_t>(in.members.size());
    const auto count = static_cast<std::uint32_t>(in.gaussians);
    const vk::Buffer set = upload(context, std::vector<float>(in.packed.begin(), in.packed.end()));
    const vk::Buffer grad = upload(context, std::vector<float>(in.packed.size(), 1));
    const vk::Buffer member = upload(context, members), begin = upload(context, begins);
    const vk::Buffer normal = upload(context, normals);
    const vk::Buffer offsets = device_buffer(context, planes);
    const vk::Buffer partial = device_buffer(context, planes), loss = device_buffer(context, 1);
    const vk::Buffer factor = upload(context, std::vector<float>{grad_loss, 0, 0, 0});
    const gaussians::PlaneViews views{
        member.range(),  begin.range(), normal.range(), offsets.range(),
        partial.range(), planes,        count};
    const gaussians::SetViews from{set.range(), set.range(), count};
    vk::Recorder recorder(context);
    EXPECT_OK(gaussians::plane_loss_forward(recorder, from, views, loss.range()));
    EXPECT_OK(gaussians::plane_loss_backward(recorder, from, views, factor.range(),
                                             {grad.range(), grad.range(), count}));
    vk::CommandList list = need(recorder.finish());
    EXPECT_OK(context.run(list));
    return {download(context, loss.range(), 1), download(context, grad.range(), in.packed.size())};
}

void expect_matches(vk::Context& context, const PlaneLossInput& in) {
    const auto expected = ref::plane_loss(in, 0.7);
    Computed got = compute(context, in, 0.7F);
    for (std::size_t i = 0; i < got.grad.size(); ++i) {
        if (expected.grad.magnitude[i] == 0) {
            EXPECT_EQ(got.grad[i], 1.0F) << i;
        }
    }
    EXPECT_TRUE(
        within_bound(got.loss, expected.loss, tolerance("plane_loss", "loss"), {"loss", ""}));
    // What was there, 1, is part of the sum.
    auto sum = expected.grad;
    for (double& value : sum.value) value += 1;
    for (double& size : sum.magnitude) size += 1;
    EXPECT_TRUE(within_bound(got.grad, sum, tolerance("plane_loss", "grad"), {"grad", ""}));
}

TEST(PlaneLossReference, GradcheckFloat64) {
    PlaneLossInput in = make_input({5, 9, 1}, 1, 0.4);
    const std::vector<double> gradient = ref::plane_loss(in, 1).grad.value;
    const auto loss = [&in](const std::vector<double>& packed) {
        in.packed = packed;
        return ref::plane_loss(in, 1).loss.value[0];
    };
    EXPECT_TRUE(gradcheck("packed", loss, in.packed, gradient));
}

TEST_P(PlaneLoss, MatchesFloat64) {
    expect_matches(context(), make_input({5, 9, 1}, 2));
    expect_matches(context(), make_input({0, 700, 0, 63, 65, 0}, 3, 0.3));
    std::vector<std::size_t> many(255, 3);
    many[100] = 20000;
    expect_matches(context(), make_input(many, 4));
}

/// A wall along two axes, of discs: only what stands out of it counts.
TEST_P(PlaneLoss, FlatGaussiansOnAPlaneCostNothing) {
    PlaneLossInput in;
    in.gaussians = 4;
    in.normals = {{0, 0, -1}};
    in.members = {{0, 1, 2, 3}};
    for (std::size_t i = 0; i < 4; ++i)
        in.packed.insert(in.packed.end(),
                         {static_cast<double>(i), 1, 2.5, 1, 0.5, 0.25, 0, 0, 1, 0, 0, 0});
    EXPECT_EQ(compute(context(), in, 1).loss[0], 0);
    EXPECT_EQ(compute(context(), in, 1).grad, std::vector<float>(48, 1));
    in.packed[2] = 6.5;  // the mean moves by 1: deviations 3, -1, -1, -1
    EXPECT_EQ(compute(context(), in, 1).loss[0], 3);
    in.packed[2] = 2.5;
    in.packed[12 + 6] = 2;  // along z
    const Computed got = compute(context(), in, 1);
    EXPECT_EQ(got.loss[0], 1);
    EXPECT_EQ(got.grad[12 + 6], 1 + 1);
}

TEST_P(PlaneLoss, RepeatsHaveTheSameBits) {
    const PlaneLossInput in = make_input({400, 90, 1000}, 5);
    const Computed first = compute(context(), in, 1), second = compute(context(), in, 1);
    EXPECT_TRUE(bit_equal(first.loss, second.loss, {"loss", ""}));
    EXPECT_TRUE(bit_equal(first.grad, second.grad, {"grad", ""}));
}

}  // namespace
}  // namespace splat::test
