// libsplat.so exports exactly the functions that the public headers declare.

#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "house/repo.h"
#include "support/expect_status.h"

namespace splat::house {
namespace {

using Names = std::set<std::string>;

/// Functions that are declared with SPLAT_API.
Names declared_in(const std::string& header) {
    static const std::regex pattern(R"(\bSPLAT_API\b[^;(]*?\b(\w+)\s*\()");
    std::string code;
    for (const std::string& line : lines_of(without_comments(header)))
        if (!starts_with(line, "#")) code += line + "\n";
    Names names;
    for (std::sregex_iterator it(code.begin(), code.end(), pattern), end; it != end; ++it)
        names.insert((*it)[1]);
    return names;
}

/// Names in the output of `nm -D --defined-only`; without the node of the version script.
Names exported_in(const std::string& nm) {
    Names names;
    for (const std::string& line : lines_of(nm)) {
        const std::string name = line.substr(line.rfind(' ') + 1);
        if (name != "SPLAT_0" && !name.empty()) names.insert(name.substr(0, name.find('@')));
    }
    return names;
}

Findings compare(const Names& declared, const Names& exported) {
    Findings findings;
    for (const std::string& name : exported) {
        if (!starts_with(name, "splat_"))
            findings.push_back("exported without the prefix splat_: " + name);
        else if (declared.count(name) == 0)
            findings.push_back("exported, but not declared in include/splat/: " + name);
    }
    for (const std::string& name : declared)
        if (exported.count(name) == 0)
            findings.push_back("declared in include/splat/, but not exported: " + name);
    return findings;
}

TEST(Symbols, ExportedAreThoseDeclared) {
    const Output nm = run(SPLAT_NM " -D --defined-only " SPLAT_LIBRARY);
    ASSERT_EQ(nm.status, 0);
    Names declared;
    for (const TextFile& file : repository())
        if (starts_with(file.path, "include/")) declared.merge(declared_in(file.text));
    EXPECT_GE(declared.size(), 10U);
    expect_none(compare(declared, exported_in(nm.text)));
}

TEST(Symbols, LibraryHasItsSonameAndNeedsNoVulkan) {
    const Output dynamic = run(SPLAT_READELF " -d " SPLAT_LIBRARY);
    ASSERT_EQ(dynamic.status, 0);
    EXPECT_HAS(dynamic.text, "Library soname: [libsplat.so.0.1]");
    EXPECT_LACKS(dynamic.text, "libvulkan");
}

TEST(Symbols, RuleAcceptsEqualSets) {
    const Names declared = declared_in(
        "#define SPLAT_API __attribute__((visibility(\"default\")))\n"
        "/* SPLAT_API int splat_old(void); */\n"
        "SPLAT_API const char* splat_a(void);\nSPLAT_API splat_result\nsplat_b(int x);\n");
    EXPECT_EQ(declared, (Names{"splat_a", "splat_b"}));
    expect_none(compare(declared, exported_in("0000000000000000 A SPLAT_0\n"
                                              "0000000000001f20 T splat_a@@SPLAT_0\n"
                                              "0000000000001f30 T splat_b\n")));
}

TEST(Symbols, RuleFindsDifferences) {
    expect_found(compare({"splat_a"}, {"splat_a", "_ZN5splat4openEv"}), 1, "without the prefix");
    expect_found(compare({"splat_a"}, {"splat_a", "splat_b"}), 1, "not declared");
    expect_found(compare({"splat_a", "splat_b"}, {"splat_a"}), 1, "not exported");
}

}  // namespace
}  // namespace splat::house
