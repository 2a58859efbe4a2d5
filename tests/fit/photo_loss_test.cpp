#include "fit/photo_loss.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "ref/losses/photo_loss_ref.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/gradcheck.h"

namespace splat::test {
namespace {

using fit::PhotoLossDesc;
using ref::PhotoLossInput;

class PhotoLoss : public testing::TestWithParam<vk::Kernels> {
  protected:
    [[nodiscard]] static vk::Context& context() { return *shared_context(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(Kernels, PhotoLoss, testing::ValuesIn(kernels_to_test()),
                         [](const auto& of) { return std::string(vk::kernels_name(of.param)); });

enum class Mask { kFull, kBorder, kHoles, kOne };

/// A ramp with noise, and a truth like it: SSIM is neither near 0 nor near 1.
PhotoLossInput make_input(std::uint32_t width, std::uint32_t height, Mask mask,
                          std::uint64_t seed) {
    PhotoLossInput in{height, width, 0.2, {}, {}};
    in.image.resize(3 * in.pixels());
    Rng rng(seed);
    for (std::size_t p = 0; p < in.pixels(); ++p) {
        const std::size_t x = p % width;
        const std::size_t y = p / width;
        bool valid = true;
        if (mask == Mask::kBorder) valid = x > 1 && y > 0 && x + 2 < width;
        if (mask == Mask::kHoles) valid = rng.uniform() < 0.7 && (x / 5 + y / 5) % 4 != 0;
        if (mask == Mask::kOne) valid = p == in.pixels() / 2;
        std::uint32_t word = valid ? 255U << 24 : p % 3 == 0 ? 254U << 24 : 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double base =
                0.2 + 0.5 * static_cast<double>(p) / static_cast<double>(in.pixels());
            const auto byte = static_cast<std::uint32_t>(255 * (base + 0.25 * rng.uniform()));
            in.image[c * in.pixels() + p] = static_cast<float>(base + 0.3 * rng.uniform());
            // Colours outside the mask must not count.
            word |= byte << (8 * c);
        }
        in.truth.push_back(word);
    }
    return in;
}

struct Outcome {
    Status status;
    fit::PhotoLossSums sums;
    std::vector<float> grad;   ///< [3,height,width]
    std::vector<float> alpha;  ///< [height,width]
    std::vector<float> partial;
};

Outcome run(vk::Context& context, const PhotoLossInput& in, double share = 1,
            std::uint32_t view = 0) {
    PhotoLossDesc desc{static_cast<std::uint32_t>(in.width), static_cast<std::uint32_t>(in.height),
                       in.ssim_weight, view};
    if (in.exposure) std::ranges::copy(*in.exposure, desc.exposure.emplace().begin());
    const std::size_t before = 4 * in.pixels() * view;
    std::vector<float> quads(before + 4 * in.pixels(), 0.625F);
    for (std::size_t i = 0; i < in.image.size(); ++i)
        quads[before + 4 * (i % in.pixels()) + i / in.pixels()] = static_cast<float>(in.image[i]);
    vk::Recorder recorder(context);
    const vk::Buffer image = upload(context, quads);
    const vk::Buffer truth = upload(context, in.truth);
    const vk::Buffer workspace =
        device_buffer(context, fit::photo_loss_workspace(recorder, desc) / 4);
    const vk::Buffer grad = upload(context, std::vector<float>(quads.size(), 3));
    const std::size_t numbers = fit::photo_loss_partial(recorder, desc) / 4;
    const vk::Buffer partial = device_buffer(context, numbers);
    Outcome result;
    result.status = fit::photo_loss(
        recorder, desc,
        {image.range(), truth.range(), workspace.range(), grad.range(), partial.range()},
        in.valid(), share);
    if (!result.status.ok()) return result;
    Result<vk::CommandList> list = recorder.finish();
    result.status = list.ok() ? context.run(list.value()) : list.status();
    if (!result.status.ok()) return result;
    result.partial = download(context, partial.range(), numbers);
    result.sums = fit::photo_loss_sums(recorder, desc, result.partial);
    std::vector<float> found = download(context, grad.range(), quads.size());
    for (std::size_t i = 0; i < before; ++i) EXPECT_EQ(found[i], 3);  // another view's
    found.erase(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(before));
    for (std::size_t c = 0; c < 4; ++c)
        for (std::size_t p = 0; p < in.pixels(); ++p)
            (c < 3 ? result.grad : result.alpha).push_back(found[4 * p + c]);
    return result;
}

constexpr Tolerance kGradTolerance = {"photo_loss", "grad_image", 4, 5e-6,
                                      "as grad_a of ssim, and a constant"};

void expect_float64(vk::Context& context, const PhotoLossInput& in, const std::string& what) {
    SCOPED_TRACE(what);
    const Outcome gpu = run(context, in, 0.5);
    ASSERT_OK(gpu.status);
    const std::array<double, 3> sums = ref::photo_loss_sums<double>(in);
    const double scale = in.divisor();
    EXPECT_NEAR(gpu.sums.absolute, sums[0], 1e-6 * scale);
    EXPECT_NEAR(gpu.sums.dissimilarity, sums[1], 2e-6 * scale);
    EXPECT_NEAR(gpu.sums.squared, sums[2], 1e-6 * scale);
    const PhotoLossDesc desc{1, 1, in.ssim_weight};
    EXPECT_NEAR(gpu.sums.loss(desc, in.valid()), ref::photo_loss_forward<double>(in), 2e-6);
    EXPECT_NEAR(gpu.sums.squared_error(in.valid()), sums[2] / scale, 1e-6);
    std::vector<ref::Rounded> grad = ref::photo_loss_backward<ref::Rounded>(in);
    for (ref::Rounded& number : grad) number = number * ref::Rounded(0.5);
    EXPECT_TRUE(matches(gpu.grad, ref::summed(grad, ref::kSsimTerms), kGradTolerance,
                        {"grad_image", reproduce(what), false, true}));
    for (std::size_t p = 0; p < in.pixels(); ++p) {
        ASSERT_EQ(gpu.alpha[p], 0) << p;
        for (std::size_t c = 0; c < 3 && !in.counts(p); ++c)
            ASSERT_EQ(gpu.grad[c * in.pixels() + p], 0) << p;
    }
}

/// Smaller than the window, lines, around the blocks of the kernels (8 and 16), and beyond a chunk of 1024.
constexpr std::uint32_t kSizes[][2] = {{1, 1},   {5, 3},   {3, 5},   {1, 40},  {40, 1},
                                       {11, 11}, {8, 8},   {16, 16}, {17, 15}, {9, 33},
                                       {33, 17}, {31, 47}, {70, 20}, {67, 120}};

TEST_P(PhotoLoss, MatchesFloat64) {
    std::uint64_t seed = 100;
    for (const auto& [width, height] : kSizes)
        for (const Mask mask : {Mask::kFull, Mask::kBorder, Mask::kHoles, Mask::kOne})
            expect_float64(context(), make_input(width, height, mask, ++seed),
                           std::to_string(width) + "x" + std::to_string(height) + " mask " +
                               std::to_string(static_cast<int>(mask)));
}

TEST_P(PhotoLoss, WeightsFromZeroToOne) {
    for (const double weight : {0.0, 1.0}) {
        PhotoLossInput in = make_input(20, 13, Mask::kHoles, 7);
        in.ssim_weight = weight;
        expect_float64(context(), in, "weight " + std::to_string(weight));
    }
}

/// Gains and offsets that mix channels; numbers of float32.
const std::vector<double> kExposure = {1.25, -0.0625, 0.125,    -0.03125, 0.0625, 0.875,
                                       0,    0.0625,  -0.09375, 0.03125,  1.125,  0.015625};

TEST_P(PhotoLoss, ThroughAnExposureMatchesFloat64) {
    std::uint64_t seed = 300;
    for (const auto& [width, height] : kSizes)
        for (const Mask mask : {Mask::kFull, Mask::kHoles, Mask::kOne}) {
            PhotoLossInput in = make_input(width, height, mask, ++seed);
            in.exposure = kExposure;
            const std::string what = std::to_string(width) + "x" + std::to_string(height) +
                                     " exposed, mask " + std::to_string(static_cast<int>(mask));
            expect_float64(context(), in, what);
            const Outcome gpu = run(context(), in, 0.5);
            ASSERT_OK(gpu.status);
            const std::vector<double> expected = ref::photo_loss_exposure_backward<double>(in);
            for (std::size_t i = 0; i < 12; ++i)
                EXPECT_NEAR(gpu.sums.exposure[i], 0.5 * expected[i], 2e-6) << what << ", " << i;
        }
}

/// Through gains of 1 and offsets of 0 nothing changes but where roundings do.
TEST_P(PhotoLoss, ThroughNoExposureIsTheSame) {
    PhotoLossInput in = make_input(37, 29, Mask::kHoles, 14);
    const Outcome without = run(context(), in);
    in.exposure.emplace(fit::kNoExposure.begin(), fit::kNoExposure.end());
    const Outcome with = run(context(), in);
    ASSERT_OK(with.status);
    EXPECT_EQ(with.grad, without.grad);
    EXPECT_EQ(with.sums.absolute, without.sums.absolute);
    EXPECT_EQ(with.sums.dissimilarity, without.sums.dissimilarity);
}

/// Views of one buffer, of a size that no alignment divides.
TEST_P(PhotoLoss, OfALaterViewIsTheSame) {
    const PhotoLossInput in = make_input(37, 29, Mask::kHoles, 11);
    const Outcome first = run(context(), in), third = run(context(), in, 1, 2);
    ASSERT_OK(third.status);
    EXPECT_EQ(first.grad, third.grad);
    EXPECT_EQ(first.partial, third.partial);
}

/// Values of bytes as the kernels make them.
void copy_truth(PhotoLossInput& in) {
    for (std::size_t i = 0; i < in.image.size(); ++i)
        in.image[i] =
            static_cast<float>(in.truth[i % in.pixels()] >> (8 * (i / in.pixels())) & 255) *
            (1.0F / 255);
}

TEST_P(PhotoLoss, EqualImagesHaveNoLoss) {
    PhotoLossInput in = make_input(37, 29, Mask::kHoles, 8);
    copy_truth(in);
    const Outcome gpu = run(context(), in);
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.sums.absolute, 0);
    EXPECT_EQ(gpu.sums.dissimilarity, 0);
    EXPECT_EQ(gpu.sums.squared, 0);
    for (const float g : gpu.grad) ASSERT_EQ(g, 0);
}

/// Variances are differences of numbers near 1, against C2 = 9e-4: a rounding of 6e-8 becomes 7e-5 of S, and is
/// the same in all pixels. As in the test of ssim.
constexpr double kFlatSsim = 1e-5;

TEST_P(PhotoLoss, FlatImages) {
    for (const std::uint32_t byte : {0U, 64U, 250U, 255U})
        for (const double shift : {0.0, 1e-4, 0.02}) {
            PhotoLossInput in = make_input(30, 23, Mask::kFull, 9);
            for (std::uint32_t& word : in.truth) word = 255U << 24 | byte << 16 | byte << 8 | byte;
            copy_truth(in);
            for (double& a : in.image) a = static_cast<float>(a + shift);
            SCOPED_TRACE("byte " + std::to_string(byte) + " shift " + std::to_string(shift));
            const Outcome gpu = run(context(), in);
            ASSERT_OK(gpu.status);
            const std::array<double, 3> sums = ref::photo_loss_sums<double>(in);
            EXPECT_GE(gpu.sums.dissimilarity, 0);
            EXPECT_NEAR(gpu.sums.dissimilarity, sums[1], kFlatSsim * in.divisor());
            EXPECT_NEAR(gpu.sums.absolute, sums[0], 1e-6 * in.divisor());
            if (shift == 0) continue;  // there the sign of a rounding decides
            const std::vector<double> expected = ref::photo_loss_backward<double>(in);
            double error = 0;
            double norm = 0;
            for (std::size_t i = 0; i < expected.size(); ++i) {
                error += std::pow(static_cast<double>(gpu.grad[i]) - expected[i], 2);
                norm += expected[i] * expected[i];
            }
            EXPECT_LE(std::sqrt(error / norm), 2e-3);
        }
}

TEST_P(PhotoLoss, NanShowsInSumsWherePixelsCount) {
    PhotoLossInput in = make_input(21, 19, Mask::kBorder, 10);
    const Outcome clean = run(context(), in);
    ASSERT_OK(clean.status);
    in.image[0] = std::numeric_limits<double>::quiet_NaN();  // outside the mask
    const Outcome outside = run(context(), in);
    ASSERT_OK(outside.status);
    EXPECT_TRUE(bit_equal(outside.grad, clean.grad, {"grad_image", reproduce("outside")}));
    EXPECT_TRUE(bit_equal(outside.partial, clean.partial, {"partial", reproduce("outside")}));
    in.image[5 * in.width + 7] = std::numeric_limits<double>::quiet_NaN();
    const Outcome inside = run(context(), in);
    ASSERT_OK(inside.status);
    EXPECT_TRUE(std::isnan(inside.sums.absolute));
    EXPECT_TRUE(std::isnan(inside.sums.loss({1, 1, 0.2}, in.valid())));
}

TEST_P(PhotoLoss, NoValidPixelHasNoGradient) {
    PhotoLossInput in = make_input(12, 9, Mask::kFull, 11);
    for (std::uint32_t& word : in.truth) word &= 0xFFFFFF;
    const Outcome gpu = run(context(), in);
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.sums.loss({12, 9, 0.2}, 0), 0);
    EXPECT_EQ(gpu.sums.squared_error(0), 0);
    for (const float g : gpu.grad) ASSERT_EQ(g, 0);
}

TEST_P(PhotoLoss, SameBitsInEveryRun) {
    const PhotoLossInput in = make_input(67, 61, Mask::kHoles, 12);
    const Outcome first = run(context(), in);
    const Outcome second = run(context(), in);
    ASSERT_OK(first.status);
    EXPECT_TRUE(bit_equal(first.grad, second.grad, {"grad_image", reproduce("twice")}));
    EXPECT_TRUE(bit_equal(first.partial, second.partial, {"partial", reproduce("twice")}));
}

TEST_P(PhotoLoss, NamesWhatIsWrong) {
    vk::Recorder recorder(context());
    const vk::Buffer buffer = device_buffer(context(), 4096);
    const vk::BufferView whole = buffer.range();
    const auto status = [&](const PhotoLossDesc& desc, std::uint32_t valid) {
        return fit::photo_loss(recorder, desc, {whole, whole, whole, whole, whole}, valid, 1);
    };
    EXPECT_ERROR(status({0, 4}, 0), Code::kInvalidArgument, "0 x 4");
    EXPECT_ERROR(status({4, 4, 1.5}, 16), Code::kInvalidArgument, "ssim_weight is 1.5");
    EXPECT_ERROR(status({4, 4}, 17), Code::kInvalidArgument, "17 valid pixels");
    EXPECT_ERROR(status({200, 40}, 1), Code::kShape, "'image'");
    EXPECT_ERROR(status({30, 30}, 1), Code::kShape, "'workspace'");
}

/// Check the gradient of one of the input's arrays, at these values.
template <class Array>
testing::AssertionResult photo_gradcheck(const char* name, const PhotoLossInput& in,
                                         Array PhotoLossInput::*array,
                                         const std::vector<double>& values,
                                         const std::vector<double>& gradient) {
    return gradcheck(
        name,
        [&](const std::vector<double>& changed_values) {
            PhotoLossInput changed = in;
            changed.*array = changed_values;
            return ref::photo_loss_forward<double>(changed);
        },
        values, gradient);
}

TEST(PhotoLossReference, GradcheckFloat64) {
    for (const Mask mask : {Mask::kFull, Mask::kHoles}) {
        const PhotoLossInput in = make_input(13, 9, mask, 13);
        EXPECT_TRUE(photo_gradcheck("image", in, &PhotoLossInput::image, in.image,
                                    ref::photo_loss_backward<double>(in)));
    }
}

TEST(PhotoLossReference, GradcheckOfAnExposureFloat64) {
    PhotoLossInput in = make_input(13, 9, Mask::kHoles, 15);
    in.exposure = kExposure;
    EXPECT_TRUE(photo_gradcheck("image", in, &PhotoLossInput::image, in.image,
                                ref::photo_loss_backward<double>(in)));
    EXPECT_TRUE(photo_gradcheck("exposure", in, &PhotoLossInput::exposure, kExposure,
                                ref::photo_loss_exposure_backward<double>(in)));
}

}  // namespace
}  // namespace splat::test
