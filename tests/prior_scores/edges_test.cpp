#include "prior_scores/edges.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/expect_status.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

using prior_scores::canny_edges;
using prior_scores::Gradient;
using prior_scores::gradient_length;

TEST(GoldenNetEdges, Canny) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("prior", [&](const Golden& golden) {
        const auto edges = need(canny_edges(
            golden.floats("edge.depth"), golden.dim("edge.depth", 0), golden.dim("edge.depth", 1)));
        const std::vector<std::int64_t> expected = golden.array("edge.canny").ints().value();
        ASSERT_EQ(edges.size(), expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i)
            EXPECT_EQ(255 * edges[i], expected[i]) << i;
    });
}

TEST(GoldenNetEdges, Gradients) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("prior", [&](const Golden& golden) {
        const std::vector<float> depth = golden.floats("edge.depth");
        const std::pair<const char*, Gradient> kinds[] = {{"edge.sobel", Gradient::kSobel},
                                                          {"edge.scharr", Gradient::kScharr},
                                                          {"edge.prewitt", Gradient::kPrewitt}};
        for (const auto& [name, kind] : kinds) {
            const auto lengths = need(gradient_length(depth, golden.dim("edge.depth", 0),
                                                      golden.dim("edge.depth", 1), kind));
            const std::vector<double> expected = golden.doubles(name);
            for (std::size_t i = 0; i < expected.size(); ++i)
                ASSERT_NEAR(lengths[i], expected[i], 1e-14) << name << " " << i;
        }
    });
}

TEST(Edges, AStepIsOneColumnOfEdges) {
    // 0 in columns 0 to 3, 1 in columns 4 to 8: both columns beside the step have equal lengths.
    const std::uint32_t height = 5, width = 9;
    std::vector<float> map(height * width);
    for (std::size_t i = 0; i < map.size(); ++i) map[i] = i % width >= 4 ? 1.0F : 0.0F;
    const auto edges = need(canny_edges(map, height, width));
    for (std::size_t i = 0; i < map.size(); ++i)
        EXPECT_EQ(edges[i], i % width == 3 ? 1 : 0) << "the first of equal ones, at " << i;
    const auto lengths = need(gradient_length(map, height, width, Gradient::kSobel));
    for (std::size_t i = 0; i < map.size(); ++i) {
        const bool beside = i % width == 3 || i % width == 4;
        EXPECT_NEAR(lengths[i], beside ? 1 : 0, 3e-9) << "4 / (4 + 1e-8), at " << i;
    }
}

TEST(Edges, WeakEdgesNeedAStrongOne) {
    // The step of a column is 4 times its height: 20/255 gives 80, weak; 60/255 gives 240, strong.
    const std::uint32_t height = 9, width = 7;
    std::vector<float> weak(height * width), joined(height * width);
    for (std::size_t i = 0; i < weak.size(); ++i) {
        const bool right = i % width >= 3;
        weak[i] = right ? 20.5F / 255 : 0;
        joined[i] = right ? (i / width < 3 ? 60.5F : 20.5F) / 255 : 0;
    }
    const auto none = need(canny_edges(weak, height, width)),
               all = need(canny_edges(joined, height, width));
    for (const std::uint8_t edge : none) EXPECT_EQ(edge, 0);
    for (const std::size_t row : {0U, 1U, 6U, 7U, 8U})
        EXPECT_EQ(all[row * width + 2], 1) << "row " << row;
}

TEST(Edges, ConstantMapsAndSinglePixelsHaveNone) {
    for (const std::uint32_t side : {1U, 2U, 5U}) {
        const std::vector<float> map(std::size_t{side} * side, 0.7F);
        const auto edges = need(canny_edges(map, side, side));
        for (const std::uint8_t edge : edges) EXPECT_EQ(edge, 0);
        for (const Gradient kind : {Gradient::kSobel, Gradient::kScharr, Gradient::kPrewitt}) {
            const auto lengths = need(gradient_length(map, side, side, kind));
            for (const double length : lengths) EXPECT_EQ(length, 0);
        }
    }
}

TEST(Edges, RefuseWhatIsNoMap) {
    const std::vector<float> two = {0, 1}, large = {0, 1.5F},
                             nan = {0, std::numeric_limits<float>::quiet_NaN()};
    EXPECT_ERROR(canny_edges(two, 1, 3), Code::kShape, "2 numbers, expected 3");
    EXPECT_ERROR(canny_edges({}, 0, 0), Code::kShape, "at least one");
    EXPECT_ERROR(canny_edges(large, 1, 2), Code::kInvalidArgument, "1.5 at number 1");
    EXPECT_ERROR(canny_edges(nan, 1, 2), Code::kInvalidArgument, "nan at number 1");
    EXPECT_OK(gradient_length(large, 1, 2, Gradient::kSobel));
    EXPECT_ERROR(gradient_length(nan, 1, 2, Gradient::kSobel), Code::kInvalidArgument,
                 "nan at number 1");
}

}  // namespace
}  // namespace splat::test
