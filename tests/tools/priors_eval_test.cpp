// Files, statistics and plots of vkrun priors eval.
#include <gtest/gtest.h>
#include <splat.h>

#include <cmath>
#include <fstream>

#include "support/system.h"
#include "vkrun/cli/failure.h"
#include "vkrun/priors/map_files.h"
#include "vkrun/priors/map_scores.h"
#include "vkrun/priors/score_plots.h"
#include "vkrun/priors/score_statistics.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;

const double kNone = std::nan("");

class PriorsEval : public ::testing::Test {
  protected:
    void TearDown() override { fs::remove_all(folder_); }

    /// An image of these samples of 8 bits, or of floats for .npy.
    fs::path write(const std::string& name, std::vector<float> samples, std::uint32_t width = 2,
                   std::uint32_t height = 1) {
        const fs::path path = folder_ / name;
        fs::create_directories(path.parent_path());
        splat_image image{};
        image.pixels = samples.data();
        image.type = SPLAT_PIXEL_F32;
        image.width = width;
        image.height = height;
        image.channels = static_cast<std::uint32_t>(samples.size() / width / height);
        EXPECT_EQ(splat_image_save(path.string().c_str(), &image), SPLAT_OK)
            << splat_last_error_message();
        return path;
    }

    fs::path folder_ = fs::temp_directory_path() / ("splat-priors-" + splat::test::process_text());
};

std::string refusal(const std::function<void()>& call) {
    try {
        call();
    } catch (const Failure& failure) {
        return failure.what();
    }
    return "";
}

TEST_F(PriorsEval, FindsMapsInFoldersAndInSrnsLayout) {
    write("flat/a.png", {0, 1});
    write("flat/deeper/b.npy", {0, 1});
    write("flat/.hidden/c.png", {0, 1});
    std::ofstream(folder_ / "flat" / "notes.txt") << "no map";
    const MapFiles flat = find_maps(folder_ / "flat", "depth");
    ASSERT_EQ(flat.size(), 2U);
    EXPECT_EQ(flat.at("deeper/b"), folder_ / "flat/deeper/b.npy");
    write("srn/car/depth/0.png", {0, 1});
    write("srn/car/rgb/0.png", {0, 0, 0, 1, 1, 1, 1, 0});
    const MapFiles depth = find_maps(folder_ / "srn", "depth");
    ASSERT_EQ(depth.size(), 1U);
    EXPECT_EQ(depth.at("car/0"), folder_ / "srn/car/depth/0.png");
    EXPECT_EQ(find_maps(folder_ / "srn", "mask").at("car/0"), folder_ / "srn/car/rgb/0.png");
    EXPECT_NE(refusal([&] { find_maps(folder_ / "srn", "normal"); }).find("no map of the kind"),
              std::string::npos);
    write("srn/car/mask/0.png", {0, 1});
    EXPECT_EQ(find_maps(folder_ / "srn", "mask").at("car/0"), folder_ / "srn/car/mask/0.png");
}

TEST_F(PriorsEval, AlphaIsAMaskAndAPictureWithoutItNone) {
    const fs::path mask = write("p/0.png", {1, 0});
    const fs::path picture = write("t/rgb/0.png", {0.5F, 0.5F, 0.5F, 1, 1, 1, 1, 0});
    ScoreOptions options;
    options.kind = "mask";
    EXPECT_NEAR(score_map(mask, picture, options)[0], 1, 1e-5);
    const fs::path half = write("t/half.png", {0, 0, 0, 0.25F, 1, 1, 1, 0});
    EXPECT_NEAR(score_map(mask, half, options)[0], 1, 1e-5);
    options.half = true;
    EXPECT_EQ(score_map(mask, half, options)[0], 0);
    const fs::path opaque = write("t/rgb/1.png", {0, 0, 0, 1, 1, 1});
    EXPECT_NE(refusal([&] { score_map(mask, opaque, options); }).find("has no alpha"),
              std::string::npos);
}

/// Other programs save masks like this: with an alpha that says nothing, and as numbers of classes.
TEST_F(PriorsEval, MasksMayBeOpaqueOrOfZeroAndOne) {
    const std::vector<float> truth = {1, 0, 0, 1, 0, 0, 0, 0};
    std::vector<float> opaque, classes;
    for (const float value : truth) {
        opaque.insert(opaque.end(), {value, value, value, 1});
        classes.push_back(value / 255);
    }
    ScoreOptions options;
    options.kind = "mask";
    const fs::path mask = write("t/mask/0.png", truth, 4, 2);
    for (const fs::path& same :
         {write("p/opaque.png", opaque, 4, 2), write("p/classes.png", classes, 4, 2)}) {
        EXPECT_NEAR(score_map(same, mask, options)[0], 1, 1e-5) << same;
        EXPECT_NEAR(score_map(mask, same, options)[0], 1, 1e-5) << same;
    }
}

TEST_F(PriorsEval, ALinkThatLeadsNowhereIsNoMissingMap) {
    write("links/a.png", {0, 1});
    SPLAT_NEED_LINKS(folder_.string());
    fs::create_symlink("/nonexistent/b.png", folder_ / "links/b.png");
    EXPECT_NE(refusal([&] {
                  find_maps(folder_ / "links", "depth");
              }).find("b.png' is a link to what does not exist"),
              std::string::npos);
}

TEST_F(PriorsEval, DepthOfImagesHasTheUnitsOfBytesAndNormalsOfNumbersAreVectors) {
    const fs::path depth = write("d.png", {100.0F / 255, 200.0F / 255});
    const fs::path constant = write("c.png", {1, 1});
    EXPECT_NEAR(score_map(constant, depth, ScoreOptions{})[1], 50, 1e-4) << "from the mean, 150";
    ScoreOptions options;
    options.kind = "normal";
    const fs::path bytes = write("n.png", {1, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F});
    const fs::path numbers = write("n.npy", {1, 0, 0, 0, 0, 0});
    EXPECT_LT(score_map(numbers, bytes, options)[0], 0.5);
    EXPECT_LT(score_map(bytes, numbers, options)[0], 0.5);
    EXPECT_TRUE(std::isnan(score_map(bytes, numbers, options)[6])) << "too small for VIF";
    EXPECT_NE(refusal([&] { score_map(depth, bytes, options); }).find("1 channels"),
              std::string::npos);
}

TEST_F(PriorsEval, PublishedScoresFindTheTruesBackgroundInPredictions) {
    constexpr std::size_t kSide = 48;
    const auto save = [&](const std::string& name, const std::function<float(std::size_t)>& object,
                          float background) {
        std::vector<float> rgba(4 * kSide * kSide, 1);
        for (std::size_t i = 0; i < kSide * kSide; ++i)
            for (std::size_t c = 0; c < 3; ++c)
                rgba[4 * i + c] = i % kSide < kSide / 2 ? object(i + c) : background;
        return write(name, rgba, kSide, kSide);
    };
    const auto ramp = [](std::size_t i) { return static_cast<float>(i * 7 % 256) / 255; };
    const fs::path truth = save("t/0.png", ramp, 188.0F / 255);
    const fs::path other = save("p/0.png", ramp, 20.0F / 255);
    ScoreOptions options;
    options.kind = "normal";
    EXPECT_LT(score_map(other, truth, options)[6], 0.99);
    options.published = true;
    EXPECT_NEAR(score_map(other, truth, options)[6], 1, 1e-6);
    const fs::path black = save("t/1.png", ramp, 0);
    EXPECT_LT(score_map(other, black, options)[6], 0.99) << "a background of another colour";
}

TEST_F(PriorsEval, GroupsAreOfTheNearestFolder) {
    fs::create_directories(folder_);
    const fs::path path = folder_ / "groups.txt";
    std::ofstream(path) << "easy car\nhard car/1\neasy gone\nhard carpet\n";
    const MapGroups groups(path.string());
    EXPECT_EQ(groups.names(), (std::vector<std::string>{"easy", "hard"}));
    EXPECT_EQ(groups.of("car/0"), "easy");
    EXPECT_EQ(groups.of("car/1"), "hard");
    EXPECT_EQ(groups.of("ca/0"), "");
    EXPECT_EQ(groups.unknown({{"car/0", ""}, {"car/1", ""}, {"carpets", ""}}),
              (std::vector<std::string>{"carpet", "gone"}));
}

/// Two methods on four maps; the fourth was scored by the first alone.
std::vector<ScoredMap> four_maps() {
    return {{"a", "x", {{1}, {2}}},
            {"b", "x", {{3}, {3}}},
            {"c", "y", {{8}, {5}}},
            {"d", "y", {{4}, {}}}};
}

TEST(PriorsStatistics, MeanMedianAndWorst) {
    const ScoreStatistics all = statistics_of(four_maps(), "", 0, 0, false);
    EXPECT_EQ(all.maps, 4U);
    EXPECT_EQ(all.mean, 4);
    EXPECT_EQ(all.median, 3.5);
    EXPECT_EQ(all.worst, 8);
    EXPECT_EQ(all.worst_map, "c");
    const ScoreStatistics group = statistics_of(four_maps(), "y", 1, 0, true);
    EXPECT_EQ(group.maps, 1U);
    EXPECT_EQ(group.worst_map, "c");
    EXPECT_EQ(statistics_of(four_maps(), "", 0, 0, true).worst_map, "a");
    EXPECT_TRUE(std::isnan(statistics_of({}, "", 0, 0, true).mean));
    EXPECT_EQ(statistics_of({{"a", "", {{kNone}}}}, "", 0, 0, true).maps, 0U);
}

TEST(PriorsStatistics, WinsAreOfMapsThatAllScored) {
    const Wins low = wins_of(four_maps(), "", 2, 0, false),
               high = wins_of(four_maps(), "", 2, 0, true);
    EXPECT_EQ(low.maps, 3U);
    EXPECT_EQ(low.by_method, (std::vector<std::size_t>{1, 1}));
    EXPECT_EQ(low.ties, 1U);
    EXPECT_EQ(high.by_method, (std::vector<std::size_t>{1, 1}));
    EXPECT_EQ(wins_of(four_maps(), "y", 2, 0, false).by_method, (std::vector<std::size_t>{0, 1}));
}

TEST(PriorsStatistics, QuantilesLieBetweenNeighbours) {
    EXPECT_EQ(quantile({1, 2, 4}, 0.5), 2);
    EXPECT_EQ(quantile({1, 2, 4}, 0.75), 3);
    EXPECT_EQ(quantile({7}, 0.25), 7);
}

TEST(PriorsPlots, AreSvgsOfAllPanels) {
    // The quartiles are 2 and 4, so 9 lies beyond the whiskers; one row has no values.
    const std::string boxes = box_svg({{"one & two", {{"m < n", {1, 2, 3, 4, 9}}, {"none", {}}}},
                                       {"empty", {}},
                                       {"constant", {{"m", {2, 2}}}},
                                       {"long", {{std::string(50, 'a') + "/end", {1}}}}});
    for (const char* part : {"<svg ", "one &amp; two", "m &lt; n", ">none<", ">empty<", "</svg>"})
        EXPECT_NE(boxes.find(part), std::string::npos) << part;
    const auto count = [](const std::string& text, const std::string& part) {
        std::size_t found = 0;
        for (std::size_t at = text.find(part); at != std::string::npos;
             at = text.find(part, at + 1))
            ++found;
        return found;
    };
    EXPECT_EQ(count(boxes, "<circle "), 1U);
    EXPECT_EQ(count(boxes, ">..." + std::string(29, 'a') + "/end<"), 1U) << "the end of a path";
    const std::string dots =
        scatter_svg({{"x", "y", {{1, 2}, {3, 4}, {3, 3}}, true}, {"u", "v", {}, false}});
    EXPECT_EQ(count(dots, "<circle "), 3U);
    EXPECT_EQ(count(dots, "#c03020"), 1U) << "where x = y";
    for (const std::string& svg : {boxes, dots}) {
        EXPECT_EQ(svg.find("nan"), std::string::npos);
        EXPECT_EQ(svg.find("inf"), std::string::npos);
    }
}

}  // namespace
}  // namespace vkrun
