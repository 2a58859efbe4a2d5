// Every key of a configuration that is named somewhere has a row in the table of src/config.

#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "config/config_file.h"
#include "house/repo.h"

namespace splat::house {
namespace {

const std::string kSections = "(data|cam_embd|model|opt|logging|general)";

/// A row, or a map of further keys; in a stage, the row of the whole training.
bool is_known(const std::string& named) {
    static const std::regex stage(R"re(^opt\.stages\.[0-9]+\.)re");
    const std::string name = std::regex_replace(named, stage, "opt.");
    for (const config::Key& key : config::all_keys())
        if (key.name == name || starts_with(key.name, name + ".")) return true;
    return false;
}

/// "model.safetensors", "data.pkl"
bool is_file_name(const std::string& name) {
    static const std::set<std::string> extensions = {"h",   "json",        "pkl",
                                                     "pth", "safetensors", "yaml"};
    return extensions.count(extension_of(name)) != 0;
}

/// Names that the text expects to be refused.
std::set<std::string> refused_in(const std::string& text) {
    static const std::regex pattern("there is no key '([a-z0-9_.]+)'");
    std::set<std::string> names;
    for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it)
        names.insert((*it)[1]);
    return names;
}

/// In quotes or backquotes, and behind --set.
Findings check_names(const TextFile& file) {
    static const std::regex pattern("(?:[\"'`]|--set )(" + kSections + "\\.[a-z0-9_.]*[a-z0-9_])");
    const std::set<std::string> refused = refused_in(file.text);
    const std::vector<std::string> lines = lines_of(file.text);
    Findings findings;
    for (std::size_t i = 0; i < lines.size(); ++i)
        for (std::sregex_iterator it(lines[i].begin(), lines[i].end(), pattern), end; it != end;
             ++it) {
            const std::string name = (*it)[1];
            if (!is_known(name) && !is_file_name(name) && refused.count(name) == 0)
                findings.push_back(at(file, i, "the key " + name + " has no row in src/config"));
        }
    return findings;
}

/// What vkrun reads of a merged configuration: config.at("opt").at("iterations"), or in two steps.
Findings check_reads(const TextFile& file) {
    static const std::regex whole(R"re((?:at\(|\[)")re" + kSections +
                                  R"re("[)\]]\.(?:at|value)\("([a-z0-9_]+)")re");
    static const std::regex section(R"re((\w+) = config_?\.at\(")re" + kSections + R"re("\);)re");
    Findings findings;
    const auto expect = [&](const std::string& name) {
        if (!is_known(name))
            findings.push_back(file.path + ": reads " + name + ", which has no row in src/config");
    };
    const std::string& text = file.text;
    for (std::sregex_iterator it(text.begin(), text.end(), whole), end; it != end; ++it)
        expect((*it)[1].str() + "." + (*it)[2].str());
    for (std::sregex_iterator it(text.begin(), text.end(), section), end; it != end; ++it) {
        const std::regex member("\\b" + (*it)[1].str() + R"re(\.at\("([a-z0-9_]+)")re");
        for (std::sregex_iterator read(text.begin(), text.end(), member); read != end; ++read)
            expect((*it)[2].str() + "." + (*read)[1].str());
    }
    return findings;
}

/// Files of configurations.
Findings check_file(const TextFile& file) {
    if (extension_of(file.path) != "yaml" && name_of(file.path) != "config.json") return {};
    const Result<Config> config = read_config(file.text, file.path);
    const Status status = config.ok() ? config::check_names(config.value()) : config.status();
    return status.ok() ? Findings() : Findings{status.message()};
}

Findings check_keys(const TextFile& file) {
    Findings findings;
    // There the keys are anything; tests of bindings misspell some to be told so.
    if (starts_with(file.path, "tests/core/") || starts_with(file.path, "tests/house/") ||
        (starts_with(file.path, "bindings/") && file.path.find("/tests/") != std::string::npos))
        return {};
    for (const auto& rule : {check_names, check_reads, check_file})
        for (const std::string& finding : rule(file)) findings.push_back(finding);
    return findings;
}

TEST(ConfigKeys, EveryOneHasARow) {
    for (const TextFile& file : repository()) expect_none(check_keys(file));
}

TEST(ConfigKeys, RuleFindsNamesWithoutARow) {
    const auto found = [](const char* path, const char* text, const char* part) {
        expect_found(check_keys({path, text}), 1, part);
    };
    found("src/a.cpp", "\nread(\"opt.base_rate\");", "src/a.cpp:2: the key opt.base_rate");
    found("src/a.cpp", "\"lower 'opt.ema.betta'\"", "opt.ema.betta");
    found("tools/x.sh", "vkrun train --set opt.stages.1.rate=1", "opt.stages.1.rate");
    found("README.md", "with `model.base_dims: 3`", "model.base_dims");
    found("tools/x.sh", "vkrun train --set logging.val=3", "logging.val");
    found("tests/a.cmake", "expect(\"no key 'opt.lr'\")", "opt.lr");
    found("tools/a.cpp", "config.at(\"opt\").at(\"iteration\")", "opt.iteration");
    found("tools/a.cpp", "plain[\"opt\"].value(\"lora\", 1)", "opt.lora");
    found("tools/a.cpp", "const Json& d = config_.at(\"data\");\nd.at(\"znear\"), d.at(\"far\")",
          "data.far");
    found("bindings/python/src/a.py", "values('opt.lr')", "opt.lr");
    found("tools/x.yaml", "opt: {base_lrr: 1}", "there is no key 'opt.base_lrr'");
    found("tools/config.json", "{\"modle\": {}}", "there is no section 'modle'");
}

TEST(ConfigKeys, RuleAcceptsOthers) {
    const auto good = [](const char* path, const char* text) {
        expect_none(check_keys({path, text}));
    };
    good("src/a.cpp", "\"opt.base_lr\", 'opt.ema', \"data.pkl\", data.values, \"adopt.me\"");
    good("README.md", "`opt.lambda_lpips`, `model.safetensors`, --set data.root=x");
    good("tests/a.cmake", "--set opt.rl=1 expect(\"there is no key 'opt.rl'\")");
    good("tools/a.cpp", "const Json& opt = config.at(\"opt\"); opt.at(\"eps\"); data.at(\"x\")");
    good("tools/x.yaml", "opt: {base_lr: 1}\nhydra: {x: 1}");
    good("tools/x.sh", "--set opt.stages.1.base_lr=1");
    good("tests/core/config_test.cpp", "\"opt.anything\"");
    good("bindings/rust/splat/tests/training.rs", "\"opt.anything\"");
}

}  // namespace
}  // namespace splat::house
