#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <string>

#include "core/decode_budget.h"
#include "core/environment.h"
#include "io/bytes.h"
#include "support/child_cost.h"
#include "support/expect_status.h"

namespace splat::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr double kSlowdown = 20;  ///< factor of time; memory of sanitizers is their own
inline constexpr std::uint64_t kSlackBytes = std::uint64_t{2} << 30U;
#else
inline constexpr double kSlowdown = 1;
inline constexpr std::uint64_t kSlackBytes =
    16U << 20U;  ///< the reader's own: tables of codecs, pieces of a file
#endif
inline constexpr double kMostSeconds = 5;  ///< times SPLAT_TIMEOUT_SCALE

using Read = std::function<Status(io::Bytes)>;

/// Reads the file; the answer holds `part`, and the cost is within the budget and `more_bytes`.
inline void expect_harmless(const char* name, const io::Buffer& file, std::string_view part,
                            const Read& read, std::uint64_t more_bytes = 0) {
    const ChildCost cost = cost_of([&] {
        const Status status = read(file);
        return status.ok() ? "read" : code_name(status.code()) + (": " + status.message());
    });
    std::printf("%-14s %9zu bytes: %5.0f MB, %5.2f s: %.110s\n", name, file.size(),
                static_cast<double>(cost.bytes) / 1e6, cost.seconds, cost.answer.c_str());
    EXPECT_HAS(cost.answer, part) << name << ": " << cost.answer;
    EXPECT_LE(cost.bytes, DecodeLimits().allowed(file.size()) + more_bytes + kSlackBytes) << name;
    const auto scale = environment_positive("SPLAT_TIMEOUT_SCALE", 1.0);
    ASSERT_OK(scale);
    EXPECT_LE(cost.seconds, kMostSeconds * kSlowdown * scale.value()) << name;
}

/// `start`, then `part` so many times, then `end`.
inline std::string repeated(const std::string& start, const std::string& part, std::size_t count,
                            const std::string& end) {
    std::string text = start;
    for (std::size_t i = 0; i < count; ++i) text += part;
    return text + end;
}

}  // namespace splat::test
