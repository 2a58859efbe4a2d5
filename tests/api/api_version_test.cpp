// Version and build info.
#include <nlohmann/json.hpp>
#include <set>

#include "api/api_calls.h"

namespace splat::test {
namespace {

using Json = nlohmann::json;

TEST(ApiVersion, IsThatOfTheHeader) {
    EXPECT_EQ(splat_version(), SPLAT_VERSION);
    const std::string text = std::to_string(SPLAT_VERSION_MAJOR) + "." +
                             std::to_string(SPLAT_VERSION_MINOR) + "." +
                             std::to_string(SPLAT_VERSION_PATCH);
    EXPECT_EQ(splat_version_string(), text);
    EXPECT_EQ(SPLAT_MAKE_VERSION(1, 2, 3), (1U << 22) + (2U << 12) + 3U);
}

TEST(ApiVersion, BuildInfoIsJsonAndLives) {
    const char* const text = splat_build_info();
    EXPECT_EQ(text, splat_build_info());
    const Json info = Json::parse(text);
    EXPECT_EQ(info.at("version"), splat_version_string());
    EXPECT_FALSE(info.at("compiler").get<std::string>().empty());
    EXPECT_TRUE(info.at("fault_points").is_boolean());
    std::set<std::string> names;
    for (const Json& shader : info.at("shaders")) {
        EXPECT_TRUE(names.insert(shader.at("name")).second) << shader;
        EXPECT_EQ(shader.at("hash").get<std::string>().size(), 64U) << shader;
        EXPECT_GT(shader.at("bytes").get<int>(), 100) << shader;
    }
    EXPECT_TRUE(names.count("group_norm_forward") == 1 && names.count("linear_forward") == 1);
}

}  // namespace
}  // namespace splat::test
