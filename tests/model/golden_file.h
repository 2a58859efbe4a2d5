#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "support/expect_status.h"
#include "support/npz.h"

namespace splat::test {

/// A file of golden/net with its name; what is not there is a failure of the test.
struct Golden {
    Npz npz;
    std::string name;

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
};

/// ||got - expected|| <= figure * ||expected||.
inline void expect_relative(const std::string& what, const std::vector<float>& got,
                            const std::vector<double>& expected, double figure) {
    ASSERT_EQ(got.size(), expected.size()) << what;
    double difference = 0, norm = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
        difference += std::pow(static_cast<double>(got[i]) - expected[i], 2);
        norm += expected[i] * expected[i];
    }
    EXPECT_GT(norm, 0) << what << ": a reference of zeros";
    EXPECT_LE(std::sqrt(difference), figure * std::sqrt(norm)) << what;
}

/// |got - expected| <= figure in every element.
inline void expect_absolute(const std::string& what, const std::vector<float>& got,
                            const std::vector<double>& expected, double figure) {
    ASSERT_EQ(got.size(), expected.size()) << what;
    double worst = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
        const double difference = std::abs(static_cast<double>(got[i]) - expected[i]);
        worst = std::isfinite(difference) ? std::max(worst, difference) : HUGE_VAL;
    }
    EXPECT_LE(worst, figure) << what;
}

}  // namespace splat::test
