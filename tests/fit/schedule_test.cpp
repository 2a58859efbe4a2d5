#include "fit/schedule.h"

#include <gtest/gtest.h>

#include "fit/growth.h"
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
