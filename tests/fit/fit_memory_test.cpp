// What a fit takes, and how it is cut to what there is.
#include "fit/fit_memory.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "support/gpu_env.h"

namespace splat::test {
namespace {

constexpr fit::FitCosts kCosts{
    .gaussian = 1000, .moved = 200, .item = 1000, .drawn_pixel = 50, .loss_pixel = 100};
constexpr std::uint64_t kMega = 1'000'000;

/// 8 photographs of 1000 x 500 pixels, the first held out.
std::vector<data::PosedPhoto> photographs() {
    std::vector<data::PosedPhoto> photos(8);
    for (data::PosedPhoto& photo : photos) {
        photo.width = 1000;
        photo.height = 500;
    }
    photos[0].held_out = true;
    return photos;
}

TEST(FitMemory, IsTheSumOfItsParts) {
    const fit::FitMemory needs = fit::fit_memory(kCosts, photographs(), 100'000, 1);
    EXPECT_EQ(needs.photographs, 7 * 4 * 500'000U);
    EXPECT_EQ(needs.gaussians, 120 * kMega);
    // Twice 63 x 32 tiles of 75 pairs and 2 of each Gaussian, and a quarter more, are 78,000 beyond the first ones.
    EXPECT_EQ(needs.rasterizer, 100 * kMega + 50 * 500'000U + 76 * 78'000U);
    EXPECT_EQ(needs.loss, 50 * kMega);
    EXPECT_EQ(needs.host, 14 * kMega / 4 + 100 * kMega);
    fit::FitCosts mapped = kCosts;
    mapped.photo_pixel = 12;
    EXPECT_EQ(fit::fit_memory(mapped, photographs(), 100'000, 1).host - needs.host, 7 * kMega);
    const fit::FitMemory few = fit::fit_memory(kCosts, photographs(), 10'000, 1);
    EXPECT_GT(few.rasterizer, 10 * kMega + 25 * kMega + 70 * 280'000U);
    EXPECT_EQ(fit::fit_memory(kCosts, photographs(), 10'000, 2).loss, 50 * kMega / 4);
}

TEST(FitMemory, IsCutToWhatThereIs) {
    const std::vector<data::PosedPhoto> photos = photographs();
    const auto plan = [&](std::uint64_t megas, bool with_host = false) {
        return need(fit::plan_memory(kCosts, photos, megas * kMega, with_host, {100'000}));
    };
    const fit::FitMemory all = fit::fit_memory(kCosts, photos, 100'000, 1);
    EXPECT_EQ(plan(400).gaussians, 100'000U);
    EXPECT_EQ(plan(400).needs.device(), all.device());
    const fit::MemoryPlan fewer = plan(250);
    EXPECT_EQ(fewer.factor, 1U);
    EXPECT_GT(fewer.gaussians, 50'000U);
    EXPECT_LE(fewer.needs.device(), 250 * kMega);
    EXPECT_GT(fit::fit_memory(kCosts, photos, fewer.gaussians + 1, 1).device(), 250 * kMega);
    const fit::MemoryPlan smaller =
        plan(150);  // 25,000 at the size of the photographs are too many
    EXPECT_EQ(smaller.factor, 2U);
    EXPECT_GE(smaller.gaussians, 25'000U);
    EXPECT_LT(plan(400, true).gaussians, 100'000U);
    // The Gaussians of a scene stay, as far as smaller photographs go; a factor that is given is the first one.
    const fit::MemoryPlan scene =
        need(fit::plan_memory(kCosts, photos, 280 * kMega, false, {100'000, 95'000, 1}));
    EXPECT_GE(scene.gaussians, 95'000U);
    EXPECT_EQ(scene.factor, 2U);
    EXPECT_ERROR(fit::plan_memory(kCosts, photos, 150 * kMega, false, {100'000, 95'000, 1}),
                 Code::kOutOfDeviceMemory, "even with 95000 Gaussians");
    EXPECT_EQ(need(fit::plan_memory(kCosts, photos, 400 * kMega, false, {100'000, 0, 3})).factor,
              3U);
    EXPECT_ERROR(fit::plan_memory(kCosts, photos, 40 * kMega, false, {100'000}),
                 Code::kOutOfDeviceMemory,
                 "even with 25000 Gaussians and 1/8 of the photographs' sides, but has 40 MB");
    EXPECT_ERROR(fit::plan_memory(kCosts, photos, 30 * kMega, false, {100}),
                 Code::kOutOfDeviceMemory, "even with 100 Gaussians");
    std::vector<data::PosedPhoto> large(2);
    for (data::PosedPhoto& photo : large) photo.width = photo.height = 1U << 20;
    EXPECT_ERROR(fit::plan_memory(kCosts, large, 40 * kMega, false, {100}),
                 Code::kOutOfDeviceMemory, "and 1/64 of the photographs' sides");
}

TEST(FitMemory, WhatIsLeftIsThere) {
    const auto context = make_context();
    const std::uint64_t left = fit::memory_left(*context);
    EXPECT_GT(left, 0U);
    EXPECT_LE(left, context->memory().use().budget);
}

}  // namespace
}  // namespace splat::test
