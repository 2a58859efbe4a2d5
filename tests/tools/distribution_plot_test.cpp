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
    // Values of 1 and 2 from 0 to 2, in 40 bins of 14 pixels from 40 on.
    for (const char* bar : {"<rect x=\"320.0\"", "<rect x=\"586.0\""})
        EXPECT_NE(svg.find(bar), std::string::npos) << bar;
}

}  // namespace
}  // namespace vkrun
