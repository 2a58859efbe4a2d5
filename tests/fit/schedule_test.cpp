#include "fit/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "fit/fit_set_ref.h"
#include "fit/growth.h"
#include "fit/truths.h"
#include "params/fit_params.h"

namespace splat::test {
namespace {

using fit::Schedule;
using fit::ScheduleDesc;

constexpr ScheduleDesc kDesc = {.gaussians = 12008, .pixels = 270 * 480, .extent = 4};

TEST(Schedule, HasTheStepsThatAreAsked) {
    for (const std::uint64_t steps : {1U, 2U, 7U, 100U, 999U, 5000U, 30000U})
        EXPECT_EQ(Schedule::of_steps(kDesc, steps).steps(), steps);
}

TEST(Schedule, OfTheStepsOfSecondsIsItself) {
    for (const double seconds : {3.0, 12.0, 33.0, 60.0, 150.0, 500.0}) {
        const Schedule by_seconds = Schedule::of_seconds(kDesc, seconds);
        const Schedule by_steps = Schedule::of_steps(kDesc, by_seconds.steps());
        for (std::uint64_t i = 0; i < by_steps.steps(); i += 10) {
            EXPECT_EQ(by_steps.at(i).factor, by_seconds.at(i).factor) << i;
            EXPECT_NEAR(
                by_steps.at(i).fraction, by_seconds.at(i).fraction,
                1.5 / static_cast<double>(by_steps.steps()));  // the last step may end earlier
        }
        double clock = 0;
        for (std::uint64_t i = 0; i < by_seconds.steps(); ++i) {
            const fit::StepPlan& step = by_seconds.at(i);
            clock +=
                fit::step_milliseconds(by_seconds.wanted(static_cast<double>(step.fraction)),
                                       step.degree, kDesc.pixels / (step.factor * step.factor));
        }
        EXPECT_NEAR(clock / 1000, seconds, 0.2);
    }
}

/// Otherwise the steps of a number of seconds could be those of another.
TEST(Schedule, LongerFitsHaveMoreSteps) {
    for (const double pixels : {1e4, 1.3e5, 5.2e5, 2e6})
        for (const std::uint32_t gaussians : {500U, 12008U, 300000U}) {
            const ScheduleDesc desc = {.gaussians = gaussians, .pixels = pixels};
            std::uint64_t before = 0;
            for (double seconds = 2; seconds < 250; seconds *= 1.02) {
                const std::uint64_t steps = Schedule::of_seconds(desc, seconds).steps();
                EXPECT_GE(steps, before) << seconds << " s, " << pixels << " pixels, " << gaussians;
                before = steps;
            }
        }
}

TEST(Schedule, GoesFromSmallToLargeAndNeverBack) {
    for (const double seconds : {5.0, 40.0, 300.0}) {
        const Schedule schedule = Schedule::of_seconds(kDesc, seconds);
        EXPECT_EQ(schedule.at(0).factor, 4);
        EXPECT_EQ(schedule.at(0).degree, 0);
        EXPECT_EQ(schedule.at(schedule.steps() - 1).factor, 1);
        EXPECT_EQ(schedule.at(schedule.steps() - 1).degree, 3);
        for (std::uint64_t i = 1; i < schedule.steps(); ++i) {
            EXPECT_LE(schedule.at(i).factor, schedule.at(i - 1).factor);
            EXPECT_GE(schedule.at(i).degree, schedule.at(i - 1).degree);
            EXPECT_GT(schedule.at(i).fraction, schedule.at(i - 1).fraction);
        }
        EXPECT_EQ(schedule.wanted(0), kDesc.gaussians);
        EXPECT_EQ(schedule.wanted(1), schedule.most_gaussians());
        EXPECT_FALSE(schedule.grows(0));
        EXPECT_LT(schedule.rates(1).mean, schedule.rates(0).mean);
    }
}

TEST(Schedule, KeepsItsLimits) {
    ScheduleDesc desc = kDesc;
    desc.sh_degree = 1;
    desc.most_gaussians = 5000;
    const Schedule schedule = Schedule::of_seconds(desc, 30);
    EXPECT_EQ(schedule.first_gaussians(), 5000);
    EXPECT_EQ(schedule.most_gaussians(), 5000);
    EXPECT_EQ(schedule.wanted(0.5), 5000);
    EXPECT_EQ(schedule.at(schedule.steps() - 1).degree, 1);
    desc.least_degree = 2;  // at most sh_degree
    EXPECT_EQ(Schedule::of_seconds(desc, 30).at(0).degree, 1);
    desc.sh_degree = 3;
    EXPECT_EQ(Schedule::of_seconds(desc, 30).at(0).degree, 2);
    EXPECT_EQ(Schedule::of_steps(desc, 9).at(8).degree, 3);
}

TEST(Schedule, GoesByItsStrategy) {
    ScheduleDesc desc = kDesc;
    desc.strategy.skip_sizes = desc.strategy.skip_bands = false;
    desc.strategy.rate = 2;
    desc.strategy.growth_every = 50;
    const Schedule schedule = Schedule::of_steps(desc, 500);
    const Schedule usual = Schedule::of_steps(kDesc, 500);
    EXPECT_EQ(schedule.at(0).factor, 1);
    EXPECT_EQ(schedule.at(0).degree, 3);
    EXPECT_TRUE(schedule.grows(150));
    EXPECT_FALSE(usual.grows(150));
    EXPECT_TRUE(usual.grows(140));  // a fourteenth of the steps is 35
    EXPECT_FALSE(Schedule::of_steps(kDesc, 20000).grows(5050));
    EXPECT_TRUE(Schedule::of_steps(kDesc, 20000).grows(5000));
    EXPECT_TRUE(usual.splits_after(150));
    EXPECT_EQ(Schedule::of_seconds(desc, 3).rates(0).rotation,
              2 * Schedule::of_seconds(kDesc, 3).rates(0).rotation);
    EXPECT_EQ(usual.rates(0.5).noise, 0);
    desc.strategy.mcmc = true;
    const Schedule mcmc = Schedule::of_steps(desc, 500);
    EXPECT_FALSE(mcmc.splits_after(150));  // no gradients are needed
    // The same for a scene in other units: lengths and areas of the noise go with the extent.
    const double noise = mcmc.rates(0.5).noise;
    desc.extent *= 10;
    EXPECT_NEAR(Schedule::of_steps(desc, 500).rates(0.5).noise * 100 / 10, noise, 1e-9 * noise);
}

TEST(Views, OfARoundAreAllOfThemBySize) {
    std::vector<data::PosedPhoto> photos(40);
    for (std::size_t i = 0; i < photos.size(); ++i) {
        photos[i].width = i % 4 == 1 ? 30 : 20;
        photos[i].height = 20;
    }
    const std::vector<std::size_t> order = fit::order_of_round(photos, 5, 6);
    EXPECT_EQ(order, fit::order_of_round(photos, 5, 6));
    EXPECT_NE(order, fit::order_of_round(photos, 5, 4));
    EXPECT_NE(order, fit::order_of_round(photos, 6, 6));
    std::set<std::size_t> all(order.begin(), order.end());
    EXPECT_EQ(all.size(), 40U);
    EXPECT_FALSE(std::is_sorted(order.begin(), order.begin() + 30));
    for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(photos[order[i]].width, i < 30 ? 20U : 30U) << i;
}

/// A step leaves out the second of two views if it has another size than the first.
TEST(Views, OfAnySizeAreDrawn) {
    // One of 20 is the smallest, between the others, the largest.
    for (const auto& [some, others] :
         {std::pair(30U, 30U), std::pair(10U, 30U), std::pair(10U, 10U)})
        for (const std::size_t count : {7U, 8U}) {
            std::vector<data::PosedPhoto> photos(count);
            for (std::size_t i = 0; i < count; ++i)
                photos[i].width = i == 0 ? 20 : i < count / 2 ? some : others;
            std::vector<int> drawn(count);
            for (std::size_t turn = 0; turn < 20 * count; turn += 2) {
                const auto at = [&](std::size_t i) {
                    return fit::order_of_round(photos, 0, i / count)[i % count];
                };
                ++drawn[at(turn)];
                if (photos[at(turn)].width == photos[at(turn + 1)].width) ++drawn[at(turn + 1)];
            }
            for (std::size_t i = 0; i < count; ++i) EXPECT_GE(drawn[i], 5) << count << ' ' << i;
        }
}

TEST(Growth, SharesAreThoseOfThePaper) {
    for (const double opacity : {0.0051, 0.1, 0.5, 0.9, 0.999})
        for (unsigned copies = 1; copies <= 51; ++copies) {
            const auto [one, scale] = ref::fit_share(opacity, copies);
            const fit::Share share = fit::share_of(opacity, copies);
            EXPECT_NEAR(share.opacity, one, 1e-12);
            EXPECT_NEAR(share.scale, scale, 1e-9 * scale) << opacity << ' ' << copies;
            if (copies == 1) {
                EXPECT_NEAR(scale, 1, 1e-12);
            }
        }
    EXPECT_LT(fit::share_of(1, 3).opacity, 1);
}

TEST(Growth, RelocatesTheFaintInProportionToOpacity) {
    std::vector<fit::Score> scores(3000);
    for (std::size_t i = 0; i < scores.size(); ++i)
        scores[i].opacity = i % 3 == 0 ? 0.005F : i % 3 == 1 ? 0.2F : 0.8F;
    const std::vector<fit::Row> rows = fit::relocated_rows(scores, 4000, 7, 100);
    ASSERT_EQ(rows.size(), 4000);
    std::vector<std::uint32_t> shares(3000);
    for (const fit::Row& row : rows) ++shares[row.source];
    std::size_t drawn = 0, by_firm = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const std::uint32_t source = rows[i].source, copies = shares[source];
        ASSERT_GT(scores[source].opacity, 0.005F);
        if (i < 3000 && i % 3 != 0) {
            EXPECT_EQ(source, i);  // they stay where they are
        } else {
            ++drawn;
            by_firm += source % 3 == 2 ? 1 : 0;
        }
        EXPECT_EQ(rows[i].role, copies == 1 ? params::kFitKeep : params::kFitShare);
        if (copies == 1) continue;
        const auto [one, scale] =
            ref::fit_share(static_cast<double>(scores[source].opacity), copies);
        EXPECT_NEAR(ref::sigmoid(rows[i].logit), std::max(one, 0.005), 1e-7);
        EXPECT_NEAR(rows[i].log_scale, std::log(scale), 1e-6);
    }
    EXPECT_EQ(drawn, 2000);
    EXPECT_NEAR(static_cast<double>(by_firm) / 2000, 0.8, 0.03);  // 3.4 standard deviations
    const auto sources = [&](std::uint64_t seed, std::uint64_t step) {
        std::vector<std::uint32_t> all;
        for (const fit::Row& row : fit::relocated_rows(scores, 4000, seed, step))
            all.push_back(row.source);
        return all;
    };
    EXPECT_EQ(sources(7, 100), sources(7, 100));
    EXPECT_NE(sources(7, 100), sources(8, 100));
    EXPECT_NE(sources(7, 100), sources(7, 200));
}

TEST(Growth, RelocationKeepsItsLimits) {
    std::vector<fit::Score> scores(200, {0, 0.001F});
    for (const fit::Row& row : fit::relocated_rows(scores, 300, 0, 100))
        EXPECT_EQ(row.role, params::kFitKeep);  // none is left to draw
    EXPECT_EQ(fit::relocated_rows(scores, 300, 0, 100).size(), 200);
    scores[5].opacity = 0.9F;
    const std::vector<fit::Row> rows = fit::relocated_rows(scores, 100, 0, 100);
    ASSERT_EQ(rows.size(), 200);
    const fit::Share share = fit::share_of(0.9F, 51);
    for (const fit::Row& row : rows) {
        EXPECT_EQ(row.source, 5);
        EXPECT_NEAR(row.log_scale, std::log(share.scale), 1e-6);
    }
}

TEST(Growth, DropsTheFaintAndSplitsTheSteepest) {
    const fit::Score scores[] = {{1, 0.5F}, {5, 0.001F}, {3, 0.5F},
                                 {0, 0.5F}, {3, 0.5F},   {9, 0.5F}};
    const std::vector<fit::Row> rows = fit::grown_rows(scores, 7);
    // Five stay; there is room for two halves more: of 5, and of 2 before 4, which is as steep.
    const std::pair<std::uint32_t, std::uint32_t> expected[] = {
        {0, params::kFitKeep},     {2, params::kFitSecondHalf}, {3, params::kFitKeep},
        {4, params::kFitKeep},     {5, params::kFitSecondHalf}, {2, params::kFitFirstHalf},
        {5, params::kFitFirstHalf}};
    ASSERT_EQ(rows.size(), std::size(expected));
    for (std::size_t i = 0; i < rows.size(); ++i)
        EXPECT_EQ(std::pair(rows[i].source, rows[i].role), expected[i]) << i;
}

TEST(Growth, AddsAtMostHalfAndNothingWithoutAGradient) {
    std::vector<fit::Score> scores(10, {1, 0.5F});
    EXPECT_EQ(fit::grown_rows(scores, 1000).size(), 15);
    EXPECT_EQ(fit::grown_rows(scores, 5).size(), 10);
    for (fit::Score& score : scores) score.gradient = 0;
    EXPECT_EQ(fit::grown_rows(scores, 1000).size(), 10);
    for (fit::Score& score : scores) score.opacity = 0;
    EXPECT_EQ(fit::grown_rows(scores, 1000).size(), 1);
}

}  // namespace
}  // namespace splat::test
