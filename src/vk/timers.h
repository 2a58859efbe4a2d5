#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vk/command.h"

namespace splat::vk {

/// Device times of dispatches, by operator label and shader. Thread-safe.
class Profile {
  public:
    void add(std::string_view op, std::string_view shader, double milliseconds, const Work& work);
    /// Time from the end of one command to the beginning of the next of the same list, `gaps` times.
    void add_idle(double milliseconds, std::uint64_t gaps);
    void reset();

    /// {"device": …, "ops": [{"op", "kernel", "count", "total_ms", "min_ms", "median_ms", "bytes",
    /// "flops"}], "idle": {"count", "total_ms"}}, longest first; bytes and flops are means over the dispatches.
    [[nodiscard]] std::string json(const std::string& device) const;
    /// The same as a table, with rates over the total time.
    [[nodiscard]] std::string table(const std::string& device) const;

  private:
    struct Entry {
        std::vector<float> times_ms;  ///< the latest kMaxTimes
        std::uint64_t count = 0;
        double total_ms = 0;
        double min_ms = 0;
        Work work;  ///< of all dispatches
    };
    struct Row {
        const std::pair<std::string, std::string>* key;
        const Entry* entry;
        double median_ms;
    };
    static constexpr std::size_t kMaxTimes =
        4096;  ///< bounds memory in long runs; the median is over the latest of these
    [[nodiscard]] std::vector<Row> rows() const;  ///< with mutex_ held

    mutable std::mutex mutex_;
    std::map<std::pair<std::string, std::string>, Entry> entries_;
    double idle_ms_ = 0;
    std::uint64_t gaps_ = 0;
};

}  // namespace splat::vk
