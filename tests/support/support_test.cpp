// The harness must be able to fail: every check gets a defect of the kind that it looks for.
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

#include "support/compare.h"
#include "support/expect_status.h"
#include "support/golden.h"
#include "support/gradcheck.h"
#include "support/rng_fill.h"
#include "support/shapes.h"
#include "support/system.h"
#include "support/tolerances.h"

namespace splat::test {
namespace {

const Tolerance kTest{"test", "sum", 4, 1e-6, "an ordinary float32 sum"};
const Subject kSum{"sum", "reproduce: -"};
const Subject kGradient{"gradient", "reproduce: -", true};

struct Sums {
    std::vector<float> gpu;
    ref::Summed<double> reference;
};

/// Sums of `terms` products each, as a device would compute them, without term `dropped` of the first
/// sum.
Sums make_sums(std::size_t count, std::size_t terms, std::size_t dropped) {
    Sums sums{std::vector<float>(count), ref::Summed<double>(count, terms)};
    const std::vector<float> a = normal_fill(count * terms, 1);
    const std::vector<float> b = normal_fill(count * terms, 2);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < terms; ++k) {
            const std::size_t at = i * terms + k;
            sums.reference.add(i, static_cast<double>(a[at]) * static_cast<double>(b[at]));
            if (i != 0 || k != dropped) sums.gpu[i] += a[at] * b[at];
        }
    return sums;
}

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

TEST(Compare, AcceptsFloatSums) {
    for (const std::size_t terms : {1U, 7U, 100U, 1000U}) {
        const Sums sums = make_sums(50, terms, kNone);
        EXPECT_TRUE(within_bound(sums.gpu, sums.reference, kTest, kSum)) << terms;
    }
}

TEST(Compare, FlagsOneDroppedTerm) {
    for (const std::size_t terms : {2U, 7U, 100U, 1000U}) {
        const Sums sums = make_sums(50, terms, terms / 2);
        EXPECT_FALSE(within_bound(sums.gpu, sums.reference, kTest, kSum)) << terms;
        EXPECT_FALSE(matches(sums.gpu, sums.reference, kTest, kSum)) << terms;
    }
}

TEST(Compare, NamesFirstMismatchAndReproducer) {
    Sums sums = make_sums(8, 4, kNone);
    sums.gpu[5] += 1;
    sums.gpu[6] += 1;
    const auto result = matches(sums.gpu, sums.reference, kTest, {"y", reproduce("seed 3")});
    const std::string message = result.message();
    EXPECT_HAS(message, "y[5]");
    EXPECT_HAS(message, "2 of 8");
    EXPECT_HAS(message, "--gtest_filter=Compare.NamesFirstMismatchAndReproducer");
    EXPECT_HAS(message, "seed 3");
}

TEST(Compare, FlagsNaNAndSize) {
    Sums sums = make_sums(8, 4, kNone);
    sums.gpu[3] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(matches(sums.gpu, sums.reference, kTest, kSum));
    EXPECT_FALSE(all_finite(sums.gpu, kSum));
    sums.gpu.pop_back();
    EXPECT_FALSE(matches(sums.gpu, sums.reference, kTest, kSum));
}

TEST(Compare, FlagsSmallErrorEverywhere) {
    Sums sums = make_sums(1000, 1000, kNone);
    for (std::size_t i = 0; i < sums.gpu.size();
         ++i)  // within each element's bound, not within the tensor's
        sums.gpu[i] = static_cast<float>(sums.reference.value[i] * (1 + 3e-6));
    EXPECT_TRUE(within_bound(sums.gpu, sums.reference, kTest, kSum));
    EXPECT_FALSE(matches(sums.gpu, sums.reference, kTest, kSum));
}

TEST(Compare, MistrustsZeros) {
    ref::Summed<double> mostly_zero(100, 1);
    for (std::size_t i = 0; i < 29; ++i) mostly_zero.add(i, 1);
    std::vector<float> gpu(mostly_zero.value.begin(), mostly_zero.value.end());
    EXPECT_FALSE(matches(gpu, mostly_zero, kTest, kSum));
    EXPECT_FALSE(exact(gpu, mostly_zero, kSum));
    mostly_zero.add(29, 1);
    gpu[29] = 1;
    EXPECT_TRUE(matches(gpu, mostly_zero, kTest, kSum));
    EXPECT_TRUE(matches(gpu, mostly_zero, kTest, kGradient));
    EXPECT_TRUE(matches({0, 0}, ref::Summed<double>(2, 1), kTest, {"y", "", true, true}));
    EXPECT_FALSE(matches({}, ref::Summed<double>(0, 1), kTest, kSum));
}

TEST(Compare, ExcusesCancellationOnlyWhereTermsCancel) {
    ref::Summed<double> cancelling(1, 2);  // 1e6 - (1e6 - 1): float32 keeps 1 to within 0.06
    cancelling.add(0, 1e6);
    cancelling.add(0, 1 - 1e6);
    EXPECT_TRUE(matches({1.05F}, cancelling, kTest, kSum));
    EXPECT_FALSE(matches({5.0F}, cancelling, kTest, kSum));
    ref::Summed<double> plain(1, 2);
    plain.add(0, 0.5);
    plain.add(0, 0.5);
    EXPECT_FALSE(matches({1.05F}, plain, kTest, kSum));
}

TEST(Compare, BitEqualSeesSignOfZeroAndNaN) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_TRUE(bit_equal({nan, 1}, {nan, 1}, kSum));
    EXPECT_FALSE(bit_equal({0.0F}, {-0.0F}, kSum));
    EXPECT_FALSE(bit_equal({1.0F}, {std::nextafter(1.0F, 2.0F)}, kSum));
    EXPECT_NE(bit_hash({0.0F}), bit_hash({-0.0F}));
    EXPECT_NE(bit_hash({1, 2}), bit_hash({2, 1}));
}

TEST(Compare, CloseBoundsBothWays) {
    EXPECT_TRUE(close({1.0F, -2.0F}, {1.0 + 1e-6, -2.0 - 2e-6}, 1e-7, 1e-6, kSum));
    EXPECT_FALSE(close({1.0F, -2.0F}, {1.0, -2.0 - 1e-5}, 1e-7, 1e-6, kSum));
}

TEST(Tolerances, RowsAreUniqueAndReasoned) {
    std::set<std::pair<std::string_view, std::string_view>> seen;
    for (const Tolerance& row : kTolerances) {
        EXPECT_TRUE(seen.emplace(row.op, row.result).second) << row.op << " " << row.result;
        EXPECT_GT(std::string_view(row.reason).size(), 10U) << row.op;
    }
    static_assert(tolerance("linear", "y").c == 4);
    EXPECT_ANY_THROW(tolerance("linear", "nothing"));
}

double cubic_loss(const std::vector<double>& x) {
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * x[i] * x[(i + 1) % x.size()];
    return sum;
}

std::vector<double> cubic_gradient(const std::vector<double>& x) {
    std::vector<double> gradient(x.size());
    const std::size_t n = x.size();
    for (std::size_t i = 0; i < n; ++i)
        gradient[i] = 2 * x[i] * x[(i + 1) % n] + x[(i + n - 1) % n] * x[(i + n - 1) % n];
    return gradient;
}

TEST(Gradcheck, AcceptsTrueGradient) {
    const std::vector<double> x = to_double(normal_fill(50, 7));
    EXPECT_TRUE(gradcheck("x", cubic_loss, x, cubic_gradient(x)));
}

TEST(Gradcheck, FlagsWrongGradient) {
    const std::vector<double> x = to_double(normal_fill(50, 7));
    for (const double factor : {1.0 + 1e-4, 0.0, -1.0}) {
        std::vector<double> gradient = cubic_gradient(x);
        gradient[49] *= factor;
        EXPECT_FALSE(gradcheck("x", cubic_loss, x, gradient)) << factor;
    }
    EXPECT_FALSE(gradcheck("x", cubic_loss, x, std::vector<double>(49)));
    EXPECT_FALSE(gradcheck("x", cubic_loss, x, std::vector<double>(50, std::nan(""))));
}

TEST(RngFill, IsSeededAndDistributed) {
    EXPECT_EQ(normal_fill(10, 3), normal_fill(10, 3));
    EXPECT_NE(normal_fill(10, 3), normal_fill(10, 4));
    const std::vector<float> values = normal_fill(100000, 5, 10, 2);
    double mean = 0;
    for (const float value : values) mean += static_cast<double>(value) / 1e5;
    double variance = 0;
    for (const float value : values)
        variance += (static_cast<double>(value) - mean) * (static_cast<double>(value) - mean) / 1e5;
    EXPECT_NEAR(mean, 10, 0.04);     // six standard errors: 6 * 2 / sqrt(1e5)
    EXPECT_NEAR(variance, 4, 0.11);  // six standard errors: 6 * 4 * sqrt(2 / 1e5)
    std::set<float> seen;
    for (const float value : integer_fill(1000, 6)) seen.insert(value);
    EXPECT_EQ(seen, (std::set<float>{-4, -3, -2, -1, 0, 1, 2, 3, 4}));
}

TEST(Shapes, ListsMeetTheCounts) {
    EXPECT_GE(std::size(kNormShapes), 24U);
    EXPECT_GE(std::size(kNormBackwardShapes), 12U);
    EXPECT_GE(std::size(kMatrixShapes), 24U);
    EXPECT_GE(std::size(kMatrixBackwardShapes), 12U);
    for (const NormShape& shape : kNormShapes) EXPECT_EQ(shape.C % shape.G, 0U) << shape.text();
    for (const NormShape& shape : kNormBackwardShapes)
        EXPECT_EQ(shape.C % shape.G, 0U) << shape.text();
}

class GoldenFolder : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = std::filesystem::temp_directory_path() / ("splat_golden_" + test::process_text());
        std::filesystem::create_directories(folder_ / "net");
        test::set_variable("SPLAT_GOLDEN_DIR", folder_.string());
    }
    void TearDown() override {
        test::unset_variable("SPLAT_GOLDEN_DIR");
        std::filesystem::remove_all(folder_);
    }
    std::filesystem::path folder_;
};

TEST_F(GoldenFolder, FindsFilesByFamily) {
    for (const char* name : {"norm_s2.npz", "norm.npz.xz", "conv.npz", "norm.txt"})
        std::ofstream(folder_ / "net" / name) << "x";
    const std::vector<std::string> files = golden_files("net", "norm");
    ASSERT_EQ(files.size(), 2U);
    EXPECT_TRUE(files[0].ends_with("/net/norm.npz.xz"));
    EXPECT_EQ(golden_name(files[0]), "norm");
    EXPECT_TRUE(files[1].ends_with("/net/norm_s2.npz"));
}

TEST_F(GoldenFolder, FailsWithoutFileAndSkipsWithoutFolder) {
    EXPECT_NONFATAL_FAILURE(golden_files("net", "norm"), "holds no file norm*.npz or *.npz.xz");
    std::filesystem::remove_all(folder_);
    EXPECT_FALSE(golden_folder().has_value());
    EXPECT_TRUE(golden_files("net", "norm").empty());
}

}  // namespace
}  // namespace splat::test
