#include "config/config_keys.h"

#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <set>

#include "config/config_file.h"
#include "core/json_tree.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using config::Key;
using config::KeyType;
using config::Settings;

constexpr const char* kAdapted = "opt: {lora_finetune: true}";

/// A configuration, with one value replaced on request.
Result<Settings> read_settings(const std::string& yaml, const std::string& change = "") {
    SPLAT_ASSIGN(Config config, read_yaml_config(yaml, "test.yaml"));
    if (!change.empty()) {
        SPLAT_ASSIGN(config, config::with_values(config, {&change, 1}));
    }
    Settings settings;
    SPLAT_ASSIGN(settings.network, config::model_config(config));
    SPLAT_ASSIGN(settings.training, config::train_config(config));
    return settings;
}

Result<Settings> read_one(const Key& key, const std::string& value) {
    const bool adapters = key.field.part == config::Part::kAdapters;
    return read_settings(adapters ? kAdapted : "{}", std::string(key.name) + "=" + value);
}

TEST(ConfigKeys, HaveAllThatTheTableShows) {
    std::set<std::string> names;
    for (const Key& key : config::all_keys()) {
        SCOPED_TRACE(key.name);
        EXPECT_TRUE(names.insert(key.name).second) << key.name << " has two rows";
        const std::string about = key.about;
        ASSERT_FALSE(about.empty());
        EXPECT_TRUE(std::isupper(static_cast<unsigned char>(about[0])) != 0);
        EXPECT_EQ(about.back(), '.');
        EXPECT_EQ(config::find_key(key.name), &key);
        const bool choice = key.field.type == KeyType::kChoice;
        EXPECT_EQ(choice, *key.values.words != '\0');
        if (!key.acts) continue;
        EXPECT_NE(config::default_text(key), "null");
        EXPECT_NE(key.field.type, KeyType::kAny);
    }
    EXPECT_EQ(config::find_key("base_lr"), nullptr);
    EXPECT_EQ(config::find_key("opt"), nullptr);
}

/// The rows of a section, and of a map in it, stand together.
TEST(ConfigKeys, StandBySection) {
    std::set<std::string> done;
    std::string before;
    for (const Key& key : config::all_keys()) {
        const std::string name = key.name;
        const std::string map = name.substr(0, name.rfind('.'));
        const std::string section = name.substr(0, name.find('.'));
        EXPECT_TRUE(section == before || done.insert(section).second) << name;
        EXPECT_TRUE(map == section || map == "opt.ema" || map == "opt.cycle" || map == "model.head")
            << name;
        before = section;
    }
}

/// A configuration that states a default is the same as one without it.
TEST(ConfigKeys, DefaultsAreThoseOfTheStructs) {
    for (const Key& key : config::all_keys()) {
        if (config::default_text(key) == "null") continue;
        const auto without =
            need(read_settings(key.field.part == config::Part::kAdapters ? kAdapted : "{}"));
        if (key.name == std::string("opt.lora_finetune")) {
            EXPECT_EQ(config::default_text(key), "false");
            continue;
        }
        const auto with = need(read_one(key, config::default_text(key)));
        EXPECT_EQ(config::merged_config_text(with), config::merged_config_text(without))
            << key.name;
        EXPECT_EQ(config::config_text(with.network), config::config_text(without.network));
    }
}

TEST(ConfigKeys, RefuseOtherTypes) {
    const std::pair<KeyType, const char*> wrong[] = {
        {KeyType::kInteger, "1.5"}, {KeyType::kNumber, "fast"},    {KeyType::kBoolean, "3"},
        {KeyType::kText, "[a]"},    {KeyType::kChoice, "nothing"}, {KeyType::kIntegers, "[1.5]"},
        {KeyType::kNumbers, "[a]"}, {KeyType::kTexts, "[1]"},      {KeyType::kMaps, "[1]"},
    };
    for (const Key& key : config::all_keys())
        for (const auto& [type, value] : wrong) {
            if (key.field.type != type) continue;
            EXPECT_ERROR(read_one(key, value), Code::kInvalidArgument,
                         std::string("'") + key.name + "'");
        }
}

TEST(ConfigKeys, RefuseValuesBeyondTheirRange) {
    for (const Key& key : config::all_keys()) {
        if (key.field.read == nullptr || *key.values.words != '\0') continue;
        const bool list =
            key.field.type == KeyType::kIntegers || key.field.type == KeyType::kNumbers;
        const auto refused = [&](double value) {
            const std::string text = format("%.17g", value);
            // Two numbers, as opt.betas has.
            EXPECT_ERROR(read_one(key, list ? "[" + text + ", " + text + "]" : text),
                         Code::kInvalidArgument,
                         "'" + std::string(key.name) + "' is " + format("%.15g", value) +
                             ", expected " + config::range_text(key));
        };
        const config::Values& v = key.values;
        if (std::isfinite(v.least)) refused(v.above ? v.least : v.least - 1);
        if (std::isfinite(v.most)) refused(v.below ? v.most : v.most + 1);
    }
    EXPECT_ERROR(read_settings("model: {xyz_bias: 1e300}"), Code::kInvalidArgument,
                 "'model.xyz_bias' is 1e+300, expected a number that float32 holds");
    EXPECT_ERROR(read_settings("model: {opacity_bias: 1e308}"), Code::kInvalidArgument,
                 "'model.opacity_bias' is 1e+308, expected a number that float32 holds");
}

TEST(ConfigKeys, SayTheirRange) {
    const auto range = [](const char* name) { return config::range_text(config::key_of(name)); };
    EXPECT_EQ(range("opt.batch_size"), "1 to 4096");
    EXPECT_EQ(range("opt.iterations"), "0 to 10^15");
    EXPECT_EQ(range("data.fov"), "0 to below 180");
    EXPECT_EQ(range("model.scale_bias"), "more than 0");
    EXPECT_EQ(range("opt.eps"), "more than 0");
    EXPECT_EQ(range("opt.ema.beta"), "0 to below 1");
    EXPECT_EQ(range("opt.loss"), "l2, l1");
    EXPECT_EQ(range("data.znear"), "");
}

TEST(ConfigKeys, AreJson) {
    const auto keys = need(parse_json_tree(config::keys_json(), "keys"));
    const JsonTree::List& rows = *keys.list();
    ASSERT_EQ(rows.size(), config::all_keys().size());
    for (const JsonTree& row : rows) {
        if (*row.find("key")->text() != "opt.betas") continue;
        EXPECT_EQ(*row.find("type")->text(), "list of numbers");
        EXPECT_EQ(*row.find("range")->text(), "0 to below 1");
        EXPECT_EQ(row.find("default")->list()->at(1).number(), 0.999);
        EXPECT_EQ(*row.find("origin")->text(), "published");
        EXPECT_TRUE(std::get<bool>(row.find("effect")->value));
        return;
    }
    FAIL() << "no row of opt.betas";
}

}  // namespace
}  // namespace splat::test
