// Options of a fit by their names.
#include "fit/fit_options.h"

#include <gtest/gtest.h>

namespace splat::test {
namespace {

fit::FitDesc with(std::vector<std::string> values) {
    fit::FitDesc desc;
    desc.data = "photos";
    desc.values = std::move(values);
    return desc;
}

TEST(FitOptions, ValuesSetWhatTheirNamesSay) {
    const auto options = fit::options_of(with({"steps=30", "white_background=true", "seed=7"}));
    ASSERT_TRUE(options.ok()) << options.status().message();
    EXPECT_EQ(options.value().steps, 30U);
    EXPECT_TRUE(options.value().white_background);
    EXPECT_EQ(options.value().seed, 7U);
    EXPECT_EQ(options.value().sh_degree, 3U);
    EXPECT_FALSE(fit::strategy_of(options.value()).mcmc);
    const auto mcmc = fit::options_of(with({"strategy=mcmc", "rate=0.5", "skip_sizes=false"}));
    ASSERT_TRUE(mcmc.ok()) << mcmc.status().message();
    EXPECT_TRUE(fit::strategy_of(mcmc.value()).mcmc);
    EXPECT_EQ(fit::strategy_of(mcmc.value()).rate, 0.5);
    EXPECT_FALSE(fit::strategy_of(mcmc.value()).skip_sizes);
}

TEST(FitOptions, ValuesWithoutEffectAreRefused) {
    const auto refused = [](const fit::FitDesc& desc, const char* text) {
        const auto options = fit::options_of(desc);
        ASSERT_FALSE(options.ok()) << text;
        EXPECT_EQ(options.status().code(), Code::kInvalidArgument);
        EXPECT_NE(options.status().message().find(text), std::string::npos)
            << options.status().message();
    };
    refused(with({"speed=9"}), "'speed=9' sets no option of a fit");
    refused(with({"steps"}), "'steps' sets no option");
    refused(with({"steps=many"}), "many is no value of steps");
    refused(with({"white_background=1"}), "whose default is false");
    refused(with({"strategy=none"}), "strategy is 'none', expected split or mcmc");
    refused(with({"rate=-1"}), "rate is -1");
    refused(with({"mcmc_noise=inf"}), "mcmc_noise is inf");
    refused(with({"growth_every=10000001"}), "growth_every is 10000001, expected 0 to");
    refused(with({"sh_degree=4"}), "sh_degree is 4, expected 0 to 3");
    refused(with({"cameras=colmpa"}), "cameras is 'colmpa', expected auto, colmap or transforms");
    refused(with({"strategy=mcmc", "skip_unseen=true"}), "skip_unseen is true, but");
    refused(with({"memory_gaussians=1"}), "memory_gaussians is 1, expected 2");
    refused(with({"depth_is_distance=true"}),
            "depth_is_distance is given, but changes nothing without depth maps");
    refused(with({"depth_weight=0.1"}), "depth_weight is given");
    refused(with({"normal_weight=0.1"}), "changes nothing without maps of normals");
    for (const char* name : {"mcmc_noise", "opacity_weight", "scale_weight"})
        refused(with({format("%s=1", name)}), "changes nothing without the strategy mcmc");
    fit::FitDesc twice = with({"seed=8"});
    twice.seed = 7;
    refused(twice, "seed is given twice");
}

TEST(FitOptions, OfMaps) {
    fit::FitDesc mapped = with({"depth_is_distance=true", "depth_weight=0.5"});
    mapped.depth = "depth";
    const auto options = fit::options_of(mapped);
    ASSERT_TRUE(options.ok()) << options.status().message();
    EXPECT_TRUE(fit::photos_of(options.value()).depth_is_distance);
    EXPECT_EQ(options.value().depth_weight, 0.5);
    const auto message = [](const fit::FitDesc& desc) {
        return fit::options_of(desc).status().message();
    };
    EXPECT_EQ(message(with({"init=depth"})), "init is depth, expected a folder of depth maps, too");
    EXPECT_EQ(message(with({"normal_weight=-1"})), "normal_weight is -1, expected a number from 0");
}

}  // namespace
}  // namespace splat::test
