// Test of the plot of vkrun compare.
#include "vkrun/compare/distribution_plot.h"

#include <gtest/gtest.h>

namespace vkrun {
namespace {

TEST(DistributionPlot, IsAnSvgOfAllPanels) {
    const std::string svg = distribution_svg(
        "a < b", {{"one & all", {1, 2, 2}, 0, 1.5, 1, 2}, {"two", {3}, 3, 3, 3, 3}});
    EXPECT_EQ(svg.rfind("<svg ", 0), 0U);
    for (const char* part : {"a &lt; b", "one &amp; all", ">two<", "</svg>"})
        EXPECT_NE(svg.find(part), std::string::npos) << part;
    EXPECT_EQ(svg.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace vkrun
