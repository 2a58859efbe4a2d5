#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "support/expect_status.h"
#include "support/golden.h"
#include "support/npz.h"
#include "support/tolerances.h"

namespace splat::test {

/// A file of golden/net; a missing key fails the test.
struct Golden {
    Npz npz;
    std::string name;      ///< name of the file, without its ending
    bool shipped = false;  ///< tests/golden/net/<family>.npz.xz itself

    [[nodiscard]] bool has(const std::string& key) const { return npz.has(key); }
    [[nodiscard]] const NpyArray& array(const std::string& key) const {
        static const NpyArray none;
        const auto found = npz.find(key);
        EXPECT_TRUE(found.ok()) << name << ": " << found.status().message();
        return found.ok() ? *found.value() : none;
    }
    [[nodiscard]] std::vector<float> floats(const std::string& key) const {
        return array(key).f32().value();
    }
    [[nodiscard]] std::vector<double> doubles(const std::string& key) const {
        return array(key).f64().value();
    }
    [[nodiscard]] std::vector<std::int64_t> dims(const std::string& key) const {
        const NpyArray& from = array(key);
        return {from.shape.begin(), from.shape.end()};
    }
    /// Channels and the like: one number of a shape. 1 behind the last axis.
    [[nodiscard]] std::uint32_t dim(const std::string& key, std::size_t axis) const {
        const NpyArray& from = array(key);
        return axis < from.shape.size() ? static_cast<std::uint32_t>(from.shape[axis]) : 1U;
    }
    [[nodiscard]] std::string text(const std::string& key) const {
        const NpyArray& from = array(key);
        return {reinterpret_cast<const char*>(from.bytes.data()), from.bytes.size()};
    }
    /// The cases, sorted, that have `<case>.<key>`.
    [[nodiscard]] std::vector<std::string> cases(const std::string& key) const {
        std::vector<std::string> found;
        for (const std::string& of : npz.names())
            if (const std::size_t dot = of.find('.');
                dot != std::string::npos && of.substr(dot + 1) == key)
                found.push_back(of.substr(0, dot));
        return found;
    }
    /// Every file has cases; the shipped one has exactly these. A test whose choice of cases is wrong
    /// would pass with none.
    void expect_cases(const std::vector<std::string>& found,
                      const std::set<std::string>& of_shipped) const {
        EXPECT_FALSE(found.empty()) << name << " holds no case for this test";
        if (shipped) {
            EXPECT_EQ(std::set<std::string>(found.begin(), found.end()), of_shipped) << name;
        }
    }
};

/// Calls `body` with each file of the family.
template <class Body>
void each_golden(const char* family, const Body& body) {
    for (const std::string& path : golden_files("net", family)) {
        auto npz = need(Npz::read(path));
        body(Golden{std::move(npz), golden_name(path), is_shipped_golden(path, family)});
        if (testing::Test::HasFatalFailure()) return;
    }
}

/// Calls `body` with each file of the family and each of its cases that has `<case>.<key>`; the shipped file has these.
template <class Body>
void each_case(const char* family, const std::string& key, const std::set<std::string>& of_shipped,
               const Body& body) {
    each_golden(family, [&](const Golden& golden) {
        const std::vector<std::string> names = golden.cases(key);
        golden.expect_cases(names, of_shipped);
        for (const std::string& name : names) body(golden, name);
    });
}

/// ||got - expected|| <= figure * ||expected||, figure times kRoundings.
inline void expect_relative(const std::string& what, const std::vector<float>& got,
                            const std::vector<double>& expected, double figure) {
    ASSERT_EQ(got.size(), expected.size()) << what;
    double difference = 0, norm = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
        difference += std::pow(static_cast<double>(got[i]) - expected[i], 2);
        norm += expected[i] * expected[i];
    }
    EXPECT_GT(norm, 0) << what << ": a reference of zeros";
    EXPECT_LE(std::sqrt(difference), kRoundings * figure * std::sqrt(norm)) << what;
}

/// |got - expected| <= figure in every element, figure times kRoundings.
inline void expect_absolute(const std::string& what, const std::vector<float>& got,
                            const std::vector<double>& expected, double figure) {
    ASSERT_EQ(got.size(), expected.size()) << what;
    double worst = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
        const double difference = std::abs(static_cast<double>(got[i]) - expected[i]);
        worst = std::isfinite(difference) ? std::max(worst, difference) : HUGE_VAL;
    }
    EXPECT_LE(worst, kRoundings * figure) << what;
}

}  // namespace splat::test
