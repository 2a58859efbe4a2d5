// What vkrun makes of the library's messages: its options and variables of the environment, no names of C.

#include <gtest/gtest.h>

#include <regex>

#include "vkrun/cli/handles.h"

namespace vkrun {
namespace {

bool names_c(const std::string& text) {
    static const std::regex variables("SPLAT_(KERNELS|VALIDATION|SELF_TEST|TIMEOUT_SCALE)");
    static const std::regex names("SPLAT_|splat_|timeout_ns|max_device_bytes");
    return std::regex_search(std::regex_replace(text, variables, ""), names);
}

TEST(OwnWords, SentencesOfAllResults) {
    int known = 0;
    for (int code = -64; code <= 64; ++code) {
        if (std::string(splat_result_name(code)) == "SPLAT_UNKNOWN_RESULT") continue;
        ++known;
        const std::string said = in_own_words(splat_result_sentence(code));
        EXPECT_FALSE(names_c(said)) << said;
    }
    EXPECT_GT(known, 10);
}

TEST(OwnWords, MessagesOfBothNames) {
    EXPECT_EQ(in_own_words("raise the limits (splat_decode_set_limits, --decode-scale)"),
              "raise the limits (--decode-scale)");
    EXPECT_EQ(in_own_words("ignore it (SPLAT_CAMERA_IGNORE_DISTORTION, --ignore-distortion)"),
              "ignore it (--ignore-distortion)");
    EXPECT_EQ(in_own_words("clear SPLAT_DEVICE_VALIDATION and SPLAT_VALIDATION"),
              "clear SPLAT_VALIDATION");
    EXPECT_EQ(in_own_words("scene.ply: data/splat_one: SPLAT_KERNELS is 'x'"),
              "scene.ply: data/splat_one: SPLAT_KERNELS is 'x'");
}

}  // namespace
}  // namespace vkrun
