#include "prior_scores/morphology.h"

#include <gtest/gtest.h>

#include "support/golden_file.h"

namespace splat::test {
namespace {

using prior_scores::closing;
using prior_scores::opening;

using Mask = std::vector<std::uint8_t>;

TEST(GoldenNetMorphology, ClosingThenOpening) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("prior", [&](const Golden& golden) {
        const auto mask_of = [&](const char* name) {
            const std::vector<std::int64_t> values = golden.array(name).ints().value();
            return Mask(values.begin(), values.end());
        };
        const std::size_t height = golden.dim("mask.bin", 0), width = golden.dim("mask.bin", 1);
        const Mask closed = closing(mask_of("mask.bin"), height, width);
        EXPECT_EQ(closed, mask_of("mask.closed"));
        EXPECT_NE(closed, mask_of("mask.bin"));
        EXPECT_EQ(opening(closed, height, width), mask_of("mask.opened"));
        EXPECT_NE(closed, mask_of("mask.opened"));
    });
}

TEST(Morphology, ClosingFillsAHoleAndOpeningClearsASpeck) {
    Mask hole(7 * 9, 1), speck(7 * 9, 0);
    hole[3 * 9 + 4] = 0;
    speck[3 * 9 + 4] = 1;
    EXPECT_EQ(closing(hole, 7, 9), Mask(7 * 9, 1));
    EXPECT_EQ(opening(speck, 7, 9), Mask(7 * 9, 0));
    EXPECT_EQ(closing(speck, 7, 9), speck);
    EXPECT_EQ(opening(hole, 7, 9), hole);
}

TEST(Morphology, BordersAreNeitherSetNorClear) {
    const Mask full(5 * 3, 1), empty(5 * 3, 0);
    EXPECT_EQ(closing(full, 5, 3), full);
    EXPECT_EQ(opening(full, 5, 3), full);
    EXPECT_EQ(closing(empty, 5, 3), empty);
    for (const std::uint8_t value : {std::uint8_t{0}, std::uint8_t{1}}) {
        EXPECT_EQ(closing(Mask{value}, 1, 1), Mask{value});
        EXPECT_EQ(opening(Mask{value}, 1, 1), Mask{value});
    }
    EXPECT_EQ(closing(Mask{255, 2, 3}, 1, 3), (Mask{1, 1, 1})) << "any number but 0 is set";
}

}  // namespace
}  // namespace splat::test
