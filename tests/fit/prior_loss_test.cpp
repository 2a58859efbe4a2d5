#include "fit/prior_loss.h"

#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "fit/prior_maps.h"
#include "ref/losses/prior_loss_ref.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/gradcheck.h"

namespace splat::test {
namespace {

using ref::PriorLossInput;

class PriorLoss : public testing::TestWithParam<vk::Kernels> {
  protected:
    [[nodiscard]] static vk::Context& context() { return *shared_context(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(Kernels, PriorLoss, testing::ValuesIn(kernels_to_test()),
                         [](const auto& of) { return std::string(vk::kernels_name(of.param)); });

std::array<double, 3> unit(std::array<double, 3> v) {
    const double size = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (double& x : v) x /= size;
    return v;
}

/// A bumpy wall that is not drawn everywhere, and maps like it with holes; normals are of any length.
PriorLossInput make_input(std::uint32_t width, std::uint32_t height, std::uint64_t seed) {
    PriorLossInput in;
    in.width = width;
    in.height = height;
    in.fx = 0.9 * width;
    in.fy = 1.1 * width;
    in.cx = 0.45 * width;
    in.cy = 0.55 * height;
    in.depth_weight = 0.7;
    in.normal_weight = 0.4;
    in.scale = 0.6;
    in.shift = -0.05;
    in.mean = 0.3;
    Rng rng(seed);
    for (std::size_t i = 0; i < in.pixels(); ++i) {
        const std::size_t x = i % width, y = i / width;
        const double alpha = rng.uniform() < 0.1 ? 0.3 : 0.6 + 0.4 * rng.uniform();
        const double z =
            3 + 0.8 * std::sin(0.4 * static_cast<double>(x + 2 * y)) + 0.05 * rng.uniform();
        in.alpha.push_back(static_cast<float>(alpha));
        in.depth.push_back(static_cast<float>(alpha * z));
        const double p = (1 / (z + 0.5 * rng.uniform()) + 0.05) / 0.6;
        in.nearness.push_back(rng.uniform() < 0.15  ? std::numeric_limits<double>::quiet_NaN()
                              : rng.uniform() < 0.1 ? 0.01  // aligned below 0
                                                    : static_cast<double>(static_cast<float>(p)));
        std::array<double, 3> normal{};
        const bool inner = x > 0 && y > 0 && x + 1 < width && y + 1 < height;
        if (inner && rng.uniform() < 0.8) {
            for (std::size_t c = 0; c < 3; ++c)
                normal[c] =
                    std::floor(255 * (c < 2 ? rng.uniform() : 0.3 * rng.uniform())) / 127.5 - 1;
        }
        in.normals.push_back(normal);
    }
    return in;
}

struct PriorOutcome {
    Status status;
    fit::PriorLosses losses;
    std::vector<float> grad_depth, grad_alpha;
    std::vector<float> partial;
};

std::vector<std::uint32_t> prior_map_of(const PriorLossInput& in) {
    std::vector<std::uint32_t> map;
    for (std::size_t i = 0; i < in.pixels(); ++i) {
        std::uint32_t word = std::isnan(in.nearness[i]) ? 0 : fit::kMapDepth;
        if (PriorLossInput::has(in.normals[i])) word |= fit::kMapNormal;
        for (std::size_t c = 0; c < 3; ++c)
            word |= static_cast<std::uint32_t>(std::lround(127.5 * (in.normals[i][c] + 1)))
                    << (8 * c);
        map.push_back(std::bit_cast<std::uint32_t>(static_cast<float>(in.nearness[i])));
        map.push_back(word);
    }
    return map;
}

/// The normals of length 1 that the map's bytes stand for.
void make_unit(PriorLossInput& in) {
    for (auto& normal : in.normals)
        if (PriorLossInput::has(normal)) normal = unit(normal);
}

PriorOutcome run(vk::Context& context, const PriorLossInput& in, bool aligned, double share = 1,
                 std::uint32_t view = 0) {
    fit::PriorLossDesc desc;
    desc.camera = {"",
                   static_cast<std::uint32_t>(in.width),
                   static_cast<std::uint32_t>(in.height),
                   in.fx,
                   in.fy,
                   in.cx,
                   in.cy,
                   {}};
    desc.view = view;
    desc.depth_weight = in.depth_weight;
    desc.normal_weight = in.normal_weight;
    if (aligned) desc.alignment = {in.scale, in.shift, in.mean};
    const std::size_t pixels = in.pixels(), before = view * pixels;
    std::vector<float> quads(4 * (before + pixels), 0.75F), extra = quads;
    for (std::size_t i = 0; i < pixels; ++i) {
        quads[4 * (before + i) + 3] = static_cast<float>(in.alpha[i]);
        extra[4 * (before + i)] = static_cast<float>(in.depth[i]);
    }
    vk::Recorder recorder(context);
    const vk::Buffer image = upload(context, quads), drawn = upload(context, extra);
    const vk::Buffer map = upload(context, prior_map_of(in));
    const vk::Buffer workspace =
        device_buffer(context, fit::prior_loss_workspace(recorder, desc) / 4);
    const vk::Buffer grad_depth = upload(context, std::vector<float>(before + pixels, 3));
    const vk::Buffer grad_image = upload(context, std::vector<float>(quads.size(), 0.25F));
    const std::size_t numbers = fit::prior_loss_partial(desc) / 4;
    const vk::Buffer partial = device_buffer(context, numbers);
    const fit::PriorCounts counts{static_cast<std::uint32_t>(in.depths()),
                                  static_cast<std::uint32_t>(in.normal_count())};
    PriorOutcome result;
    result.status = fit::prior_loss(recorder, desc,
                                    {image.range(), drawn.range(), map.range(), workspace.range(),
                                     grad_depth.range(), grad_image.range(), partial.range()},
                                    counts, share);
    if (!result.status.ok()) return result;
    Result<vk::CommandList> list = recorder.finish();
    result.status = list.ok() ? context.run(list.value()) : list.status();
    if (!result.status.ok()) return result;
    result.partial = download(context, partial.range(), numbers);
    if (aligned) std::fill_n(result.partial.begin(), numbers / 2, 0.0F);  // not written
    result.losses = fit::prior_loss_sums(result.partial, counts);
    const std::vector<float> by_depth = download(context, grad_depth.range(), before + pixels);
    const std::vector<float> by_image = download(context, grad_image.range(), quads.size());
    for (std::size_t i = 0; i < before; ++i) EXPECT_EQ(by_depth[i], 3);  // another view's
    for (std::size_t i = before; i < before + pixels; ++i) {
        result.grad_depth.push_back(by_depth[i]);
        result.grad_alpha.push_back(by_image[4 * i + 3] - 0.25F);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(by_image[4 * i + c], 0.25F);
    }
    return result;
}

constexpr Tolerance kPriorTolerance = {"prior_loss", "grad_depth", 8, 1e-6,
                                       "quotients of differences of places"};
/// It is added to 1/4, whose roundings stay.
constexpr double kAlphaTolerance = 1e-4;

void expect_float64(vk::Context& context, PriorLossInput in, const std::string& what) {
    SCOPED_TRACE(what);
    const PriorOutcome gpu = run(context, in, true, 0.5);
    ASSERT_OK(gpu.status);
    make_unit(in);
    const auto expected = ref::prior_loss<double>(in);
    EXPECT_NEAR(gpu.losses.depth, expected.depth, 1e-5);
    EXPECT_NEAR(gpu.losses.normal, expected.normal, 1e-5);
    auto rounded = ref::prior_loss<ref::Rounded>(in);
    for (ref::Rounded& number : rounded.grad_depth) number = number * ref::Rounded(0.5);
    EXPECT_TRUE(matches(gpu.grad_depth, ref::summed(rounded.grad_depth, 8), kPriorTolerance,
                        {"grad_depth", reproduce(what), false, true}));
    double most = 0;
    for (const double g : expected.grad_alpha) most = std::max(most, std::abs(g));
    for (std::size_t i = 0; i < in.pixels(); ++i)
        EXPECT_NEAR(gpu.grad_alpha[i], 0.5 * expected.grad_alpha[i], kAlphaTolerance * most + 6e-8)
            << i;
}

/// Without an inside, around a workgroup of 64, and beyond a chunk of 1024.
TEST_P(PriorLoss, MatchesFloat64) {
    std::uint64_t seed = 20;
    for (const auto& [width, height] : {std::pair{2U, 2U}, {3U, 3U}, {5U, 13U}, {67U, 40U}})
        expect_float64(context(), make_input(width, height, ++seed),
                       std::to_string(width) + "x" + std::to_string(height));
}

TEST_P(PriorLoss, OneAlone) {
    PriorLossInput in = make_input(23, 17, 31);
    in.normal_weight = 0;
    expect_float64(context(), in, "depth");
    in = make_input(23, 17, 32);
    in.depth_weight = 0;
    expect_float64(context(), in, "normals");
}

/// The result is the one by a known alignment.
TEST_P(PriorLoss, AlignsToWhatIsDrawn) {
    PriorLossInput in = make_input(67, 40, 33);
    const PriorOutcome found = run(context(), in, false);
    ASSERT_OK(found.status);
    const auto [scale, shift, mean] = ref::prior_alignment(in);
    in.scale = scale;
    in.shift = shift;
    in.mean = mean;
    make_unit(in);
    const auto expected = ref::prior_loss<double>(in);
    EXPECT_NEAR(found.losses.depth, expected.depth, 1e-4 * expected.depth);
    std::size_t wrong = 0;  // where y is y0 but for roundings, the sign may differ
    for (std::size_t i = 0; i < in.pixels(); ++i)
        wrong += std::abs(static_cast<double>(found.grad_depth[i]) - expected.grad_depth[i]) >
                         1e-3 * std::abs(expected.grad_depth[i]) + 1e-6
                     ? 1
                     : 0;
    EXPECT_LE(wrong, 2);
}

TEST_P(PriorLoss, AMapThatIsContradictedHasNone) {
    PriorLossInput in = make_input(31, 22, 34);
    for (double& p : in.nearness) p = 1 - p;
    const PriorOutcome found = run(context(), in, false);
    ASSERT_OK(found.status);
    EXPECT_EQ(found.losses.depth, 0);
    EXPECT_GT(found.losses.normal, 0);
    for (double& p : in.nearness) p = 0.5;
    EXPECT_EQ(run(context(), in, false).losses.depth, 0);
}

TEST_P(PriorLoss, OfALaterViewIsTheSameOnEveryRun) {
    const PriorLossInput in = make_input(37, 29, 35);
    const PriorOutcome first = run(context(), in, false), third = run(context(), in, false, 1, 2);
    ASSERT_OK(third.status);
    EXPECT_EQ(first.grad_depth, third.grad_depth);
    EXPECT_EQ(first.grad_alpha, third.grad_alpha);
    EXPECT_EQ(first.partial, third.partial);
}

TEST_P(PriorLoss, NamesWhatIsWrong) {
    vk::Recorder recorder(context());
    const vk::Buffer buffer = device_buffer(context(), 1024);
    const vk::BufferView whole = buffer.range();
    const auto status = [&](std::uint32_t width, std::uint32_t height) {
        fit::PriorLossDesc desc;
        desc.camera.width = width;
        desc.camera.height = height;
        return fit::prior_loss(recorder, desc, {whole, whole, whole, whole, whole, whole, whole},
                               {}, 1);
    };
    EXPECT_ERROR(status(0, 4), Code::kInvalidArgument, "0 x 4");
    EXPECT_ERROR(status(40, 40), Code::kShape, "'image'");
    EXPECT_ERROR(status(16, 16), Code::kShape, "'workspace'");
}

TEST(PriorLossReference, GradcheckFloat64) {
    PriorLossInput in = make_input(9, 8, 36);
    make_unit(in);
    const auto out = ref::prior_loss<double>(in);
    const auto loss = [](const PriorLossInput& input) {
        const auto found = ref::prior_loss<double>(input);
        return input.depth_weight * found.depth + input.normal_weight * found.normal;
    };
    const auto with = [&](std::vector<double> PriorLossInput::*member) {
        return [&in, loss, member](const std::vector<double>& x) {
            PriorLossInput changed = in;
            changed.*member = x;
            return loss(changed);
        };
    };
    EXPECT_TRUE(gradcheck("depth", with(&PriorLossInput::depth), in.depth, out.grad_depth));
    EXPECT_TRUE(gradcheck("alpha", with(&PriorLossInput::alpha), in.alpha, out.grad_alpha));
}

}  // namespace
}  // namespace splat::test
