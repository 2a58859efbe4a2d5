#include "core/config.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/expect_status.h"

namespace splat {
namespace {

constexpr const char* kYaml = R"(# merged by hydra
general:
  device: 0
  random_seed: 0
  mixed_precision: false   # comment
opt:
  iterations: 800001
  base_lr: 5e-05
  betas:
  - 0.9
  - 0.999
  loss: l2
  pretrained_ckpt: null
  pretrained_hf:
  lora_finetune: yes
  step_lr: [1, 2.5, 1e3]
  ema: {use: true, beta: .9999, update_every: 10}
data:
  category: cars_priors
  "origin_distances": False
  bg: [0, 0, 0]
  name: "123"
  path: '${hydra:runtime.cwd}/x'
  octal: 010
  negative: -3
  text: hello world
  block: |
    two
    lines
defaults:
- dataset: cars
- _self_
)";

TEST(Config, ReadsYamlOfHydra) {
    const Config config = need(read_yaml_config(kYaml, "config.yaml"));
    EXPECT_EQ(config.get<std::int64_t>("opt.iterations", 0).value(), 800001);
    EXPECT_EQ(config.get<double>("opt.iterations", 0).value(), 800001.0);
    EXPECT_EQ(config.get<double>("opt.base_lr", 0).value(), 5e-5);
    EXPECT_EQ(config.get<bool>("general.mixed_precision", true).value(), false);
    EXPECT_EQ(config.get<bool>("opt.lora_finetune", false).value(), true);
    EXPECT_EQ(config.get<bool>("data.origin_distances", true).value(), false);
    EXPECT_EQ(config.get<std::string>("opt.loss", "").value(), "l2");
    EXPECT_EQ(config.get<std::string>("opt.pretrained_ckpt", "none").value(), "none");
    EXPECT_EQ(config.get<std::string>("opt.pretrained_hf", "none").value(), "none");
    EXPECT_EQ(config.get<std::string>("absent", "default").value(), "default");
    EXPECT_EQ(config.get<double>("opt.ema.beta", 0).value(), 0.9999);
    EXPECT_EQ(config.get<std::string>("data.name", "").value(), "123");
    EXPECT_EQ(config.get<std::string>("data.path", "").value(), "${hydra:runtime.cwd}/x");
    EXPECT_EQ(config.get<std::string>("data.octal", "").value(), "010");
    EXPECT_EQ(config.get<std::int64_t>("data.negative", 0).value(), -3);
    EXPECT_EQ(config.get<std::string>("data.text", "").value(), "hello world");
    EXPECT_EQ(config.get<std::string>("data.block", "").value(), "two\nlines\n");
    EXPECT_EQ(config.get_list<double>("opt.betas", {}).value(), (std::vector<double>{0.9, 0.999}));
    EXPECT_EQ(config.get_list<double>("opt.step_lr", {}).value(),
              (std::vector<double>{1, 2.5, 1000}));
    EXPECT_EQ(config.get_list<std::int64_t>("data.bg", {}).value(),
              (std::vector<std::int64_t>{0, 0, 0}));
    EXPECT_EQ(config.get_list<std::int64_t>("absent", {7}).value(), (std::vector<std::int64_t>{7}));
    EXPECT_EQ(config.get<std::string>("defaults.0.dataset", "").value(), "cars");
    EXPECT_EQ(config.get_list<std::string>("defaults", {}).value(),
              (std::vector<std::string>{"_self_"}));
}

TEST(Config, JsonAndYamlAgree) {
    const std::string json =
        R"({"a": {"b": 1, "c": [1.5, 2], "d": [{"e": null}, true]}, "f": "text", "g": []})";
    const std::string yaml =
        "a:\n  b: 1\n  c: [1.5, 2]\n  d:\n  - e: ~\n  - true\nf: text\ng: []\n";
    // Nearly all JSON is YAML, so all three readings agree.
    for (const auto& read : {read_config(json, "x"), read_config(yaml, "x"),
                             read_yaml_config(json, "x"), read_json_config(json, "x")}) {
        ASSERT_OK(read);
        std::string all;
        for (const ConfigEntry& entry : read.value().entries())
            all += entry.key +
                   (entry.list  ? "[]"
                    : entry.map ? "{}"
                                : "") +
                   std::to_string(entry.values.size()) + " ";
        EXPECT_EQ(all, "a{}0 a.b1 a.c[]2 a.d[]1 a.d.0{}0 a.d.0.e1 f1 g[]0 ");
    }
}

TEST(Config, NumbersOfYaml) {
    const auto value = [](const std::string& text) {
        return need(read_yaml_config("x: " + text, "x")).entries()[0].values[0];
    };
    EXPECT_EQ(value("0"), ConfigScalar(std::int64_t{0}));
    EXPECT_EQ(value("+12"), ConfigScalar(std::int64_t{12}));
    EXPECT_EQ(value("-9223372036854775808"), ConfigScalar(INT64_MIN));
    EXPECT_EQ(value("9223372036854775808"), ConfigScalar(9223372036854775808.0));
    EXPECT_EQ(value("1e-5"), ConfigScalar(1e-5));
    EXPECT_EQ(value("-.5"), ConfigScalar(-0.5));
    EXPECT_EQ(value("1."), ConfigScalar(1.0));
    EXPECT_EQ(value("-.inf"), ConfigScalar(-HUGE_VAL));
    EXPECT_TRUE(std::isnan(std::get<double>(value(".nan"))));
    for (const char* text : {"1e", "e5", "--1", "1.2.3", "0x10", "1_000", "12:30", ".", "+", "+-1",
                             "00", "007", "1e5x", "nan", "inf", "True1"})
        EXPECT_EQ(value(text), ConfigScalar(std::string(text)));
}

TEST(Config, RefusesWhatItDoesNotRead) {
    const auto refused = [](const std::string& text, const char* part,
                            Code code = Code::kInvalidArgument) {
        EXPECT_ERROR(read_config(text, "c.yaml"), code, part);
    };
    refused("a: 1\nb: 2\na: 3\n", "the key 'a' appears twice (line 3)");
    refused("a:\n  b: 1\n  b: 2\n", "'a.b' appears twice");
    refused("a: &x 1\nb: 2\n", "line 1: anchors", Code::kUnsupported);
    refused("a: *x\n", "aliases", Code::kUnsupported);
    refused("a: !!python/object:os.system x\n", "tags", Code::kUnsupported);
    refused("a: !!map {b: 1}\n", "tags", Code::kUnsupported);
    refused("a:\n  <<: {b: 1}\n", "merge keys", Code::kUnsupported);
    refused("a: [1, 2\n", "not valid YAML");
    refused("a: 1\n---\nb: 2\n", "a second document");
    refused("- 1\n", "a list, expected a map");
    refused("text\n", "a scalar, expected a map");
    refused("? [1, 2]\n: 3\n", "a key that is not a scalar");
    refused("a: " + std::string(40, '[') + std::string(40, ']') + "\n", "deeper than 32 levels");
    refused("a: \xff\xfe\n", "not valid YAML");
    refused("a: 1\tb: 2: 3\n", "not valid YAML");
    refused(std::string(kMaxConfigBytes + 1, '#'), "expected at most");
    refused(R"({"a": 1, "a": 2})", "'a' appears twice");
    refused("{\"a\": [1, 2}", "not valid JSON");
    refused(std::string("a: 1\n") + '\0' + "b: 2\n", "c.yaml: a NUL at byte 5 of 11");
    refused(std::string("{\"a\": 1}") + '\0' + "{}", "c.yaml: a NUL at byte 8 of 11");
    for (const char* nul : {"\\0", "\\x00", "\\u0000", "\\U00000000"}) {
        const std::string text = std::string("\"ds") + nul + "z\"";
        refused("a: 1\nb: {c: " + text + "}\n", "c.yaml: line 2: an escaped NUL");
        refused("a: [" + text + "]\n", "line 1: an escaped NUL");
        refused(text + ": 1\n", "line 1: an escaped NUL");
    }
    refused(R"({"data": {"root": "ds\u0000z"}})", "c.yaml: an escaped NUL (\\u0000) at byte 21");
    std::string many;
    for (std::size_t i = 0; i <= kMaxConfigEntries; ++i) many += "k" + std::to_string(i) + ": 1\n";
    refused(many, "more than 100000 keys");
    EXPECT_OK(read_config("", "x"));
    EXPECT_OK(read_config("# nothing\n", "x"));
}

TEST(Config, SaysWhatKindItExpects) {
    const Config config = need(read_yaml_config("a: text\nb: [1]\nc: {d: 1.5}\n", "c.yaml"));
    EXPECT_ERROR(config.get<double>("a", 0), Code::kInvalidArgument,
                 "c.yaml: 'a' is a text, expected a number");
    EXPECT_ERROR(config.get<bool>("b", false), Code::kInvalidArgument, "'b' is a list");
    EXPECT_ERROR(config.get<bool>("c", false), Code::kInvalidArgument, "'c' is a map");
    EXPECT_ERROR(config.get<std::int64_t>("c.d", 0), Code::kInvalidArgument,
                 "'c.d' is a number, expected a whole number");
    EXPECT_ERROR(config.get_list<double>("a", {}), Code::kInvalidArgument, "not a list");
    EXPECT_ERROR(config.get_list<std::string>("b", {}), Code::kInvalidArgument,
                 "the list 'b' holds a whole number, expected a text");
}

TEST(Config, NamesTheNearestKey) {
    const Config config = need(read_yaml_config("opt:\n  base_l: 1\n", "c.yaml"));
    EXPECT_ERROR(config.refuse_unknown({"opt.base_lr", "opt.betas"}, {"opt"}),
                 Code::kInvalidArgument,
                 "there is no key 'opt.base_l'; did you mean 'opt.base_lr'?");
    EXPECT_ERROR(config.refuse_unknown({"something.else.entirely"}, {"model", "opt"}),
                 Code::kInvalidArgument, "c.yaml: there is no key 'opt.base_l'");
    EXPECT_OK(config.refuse_unknown({"opt.base_l"}, {"opt"}));
    EXPECT_OK(config.refuse_unknown({}, {"model", "op"}));
    EXPECT_ERROR(config.refuse_unknown_sections({"model", "opts"}), Code::kInvalidArgument,
                 "c.yaml: there is no section 'opt'; did you mean 'opts'?");
    EXPECT_OK(config.refuse_unknown_sections({"opt"}));
    EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
    EXPECT_EQ(edit_distance("", "abc"), 3U);
    EXPECT_EQ(nearest_name("depht", {"width", "depth"}), "depth");
    EXPECT_EQ(nearest_name("x", {"completely"}), "");
}

/// A value that cannot hold keys is not a section, and a map without known keys is not a known
/// section.
TEST(Config, RefusesSectionsWithoutKeys) {
    const auto status = [](const char* text) {
        const auto config = need(read_yaml_config(text, "c.yaml"));
        return config.refuse_unknown({"opt.lr", "opt.ema.use"}, {"opt", "model"});
    };
    EXPECT_ERROR(status("opt: 5\n"), Code::kInvalidArgument,
                 "c.yaml: 'opt' is a whole number, expected keys below it");
    EXPECT_ERROR(status("opt: text\n"), Code::kInvalidArgument, "'opt' is a text");
    EXPECT_ERROR(status("model: [1, 2]\n"), Code::kInvalidArgument, "'model' is a list");
    EXPECT_ERROR(status("opt: {foo: {}}\n"), Code::kInvalidArgument, "there is no key 'opt.foo'");
    EXPECT_ERROR(status("opt: {ema: {foo: {}}}\n"), Code::kInvalidArgument,
                 "there is no key 'opt.ema.foo'");
    for (const char* good : {"opt:\nmodel: {}\n", "opt: {ema: {use: true}, lr: 1}\n",
                             "opt: {ema: {}}\n", "hydra: 5\nwandb: [1]\ndefaults: [a]\n"})
        EXPECT_OK(status(good)) << good;
}

}  // namespace
}  // namespace splat
