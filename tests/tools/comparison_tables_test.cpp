// Tests of the tables of vkrun compare and vkrun report.
#include "vkrun/compare/comparison_tables.h"

#include <gtest/gtest.h>

#include <cmath>

#include "vkrun/cli/handles.h"

namespace vkrun {
namespace {

ComparedMetric compared(splat_metric metric, const char* name) {
    ComparedMetric made{name, "better", sized<splat_metric_comparison>()};
    splat_metric_comparison& f = made.found;
    f.metric = metric;
    f.n_a = f.n_b = 30;
    f.mean_a = 20.25;
    f.mean_b = 20.75;
    f.difference = 0.5;
    f.low = 0.25;
    f.high = 0.75;
    f.bca_low = 0.375;
    f.bca_high = 0.875;
    f.p_permutation = 1.25e-5;
    f.p_holm = 2.5e-5;
    f.p_parametric = 0.0625;
    f.effect = 1.5;
    f.p_wilcoxon = 0.015625;
    f.p_wilcoxon_holm = 0.03125;
    f.wilcoxon_w = 400.5;
    f.wilcoxon_n = 28;
    f.wilcoxon_tied = 1;
    f.wins_a = 8;
    f.wins_b = 20;
    f.ties = 2;
    return made;
}

ComparisonTable table() {
    ComparisonTable made;
    made.baseline = "runs/base_1";
    made.add("a, {b} & 100%",
             {compared(SPLAT_METRIC_PSNR, "psnr"), compared(SPLAT_METRIC_LPIPS, "lpips")},
             {{"paired", true}, {"permutations", 300000}, {"bootstraps", 10000}});
    return made;
}

TEST(ComparisonTables, CsvHasIntervalsAndNamesOfTests) {
    ComparisonTable made = table();
    made.rows[1].compared.found.bca_low = NAN;
    made.rows[1].compared.found.exact = 1;
    made.rows[1].compared.found.wilcoxon_exact = 1;
    const std::string csv = comparison_csv(made);
    EXPECT_EQ(
        csv.substr(csv.find('\n') + 1),
        "runs/base_1,\"a, {b} & 100%\",psnr,30,30,20.25,20.75,0.5,0.25,0.75,0.375,0.875,"
        "10000,1.25e-05,2.5e-05,300000 random sign flips,0.0625,paired Student's t,1.5,"
        "0.015625,0.03125,signed rank: normal approximation with tie correction; zeros "
        "dropped,400.5,28,20,2,8,0,0,0,better\r\n"
        "runs/base_1,\"a, {b} & 100%\",lpips,30,30,20.25,20.75,0.5,0.25,0.75,,0.875,"
        "10000,1.25e-05,2.5e-05,all sign flips,0.0625,paired Student's t,1.5,"
        "0.015625,0.03125,signed rank: exact; zeros dropped,400.5,28,20,2,8,0,0,0,better\r\n");
    made.paired = false;
    const std::string unpaired = comparison_csv(made);
    EXPECT_NE(unpaired.find("300000 random shuffles,0.0625,normal distribution of means,1.5"
                            ",,,,,,,,,,,,better"),
              std::string::npos)
        << unpaired;
    const std::string heading = csv.substr(0, csv.find('\r'));
    const std::string plain = unpaired.substr(unpaired.rfind("lpips"));
    EXPECT_EQ(std::count(heading.begin(), heading.end(), ','),
              2 + std::count(plain.begin(), plain.end(), ','));
}

TEST(ComparisonTables, LatexNamesIntervalsTestsAndCorrections) {
    ComparisonTable made = table();
    made.rows[1].compared.found.wilcoxon_exact = 1;
    made.rows[1].compared.found.bca_low = NAN;
    const std::string text = comparison_latex(made);
    for (const char* part :
         {"\\caption{Means over objects, compared with runs/base\\_1, paired by object.",
          "bias-corrected and accelerated (BCa, Efron 1987; 10000 samples)",
          "all sign flips of up to 20 differences, else 300000 random ones",
          "Holm-corrected for 2 metrics", "Wilcoxon signed rank test, exact, or where marked",
          "differences of 0 dropped (Wilcoxon's rule)", "{@{}llrrrrcrrc@{}}",
          "a, \\{b\\} \\& 100\\% & PSNR $\\uparrow$ & 30 & $20.250$ & $20.750$ & $+0.500$ & "
          "$[+0.375, +0.875]$ & $2.5\\mathrm{e}{-5}$ & $0.031$$^\\approx$ & 20/2/8 \\\\\n",
          "LPIPS $\\downarrow$ & 30 & $20.2500$ & $20.7500$ & $+0.5000$ & -- & "
          "$2.5\\mathrm{e}{-5}$ & $0.031$ & 20/2/8 \\\\\n",
          "\\end{tabular}\n\\end{table}\n"})
        EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
    made.rows[0].compared.found.image_wins_b = 7;
    const std::string images = comparison_latex(made);
    EXPECT_NE(images.find("20/2/8 & 7/0/0 \\\\\n"), std::string::npos) << images;
    EXPECT_NE(images.find("20/2/8 & -- \\\\\n"), std::string::npos) << images;
    EXPECT_NE(images.find("{@{}llrrrrcrrcc@{}}"), std::string::npos);
    made.baseline = "\\x~y^z$#\n";
    EXPECT_NE(comparison_latex(made).find("\\textbackslash{}x\\~{}y\\^{}z\\$\\# ,"),
              std::string::npos);
}

}  // namespace
}  // namespace vkrun
