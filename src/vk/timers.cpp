#include "vk/timers.h"

#include <algorithm>

#include "core/json_writer.h"

namespace splat::vk {

void Profile::add(std::string_view op, std::string_view shader, double milliseconds,
                  const Work& work) {
    const std::lock_guard lock(mutex_);
    Entry& entry = entries_[{std::string(op), std::string(shader)}];
    entry.min_ms = entry.count == 0 ? milliseconds : std::min(entry.min_ms, milliseconds);
    if (entry.times_ms.size() < kMaxTimes)
        entry.times_ms.push_back(static_cast<float>(milliseconds));
    else
        entry.times_ms[entry.count % kMaxTimes] = static_cast<float>(milliseconds);
    ++entry.count;
    entry.total_ms += milliseconds;
    entry.work.bytes += work.bytes;
    entry.work.flops += work.flops;
}

void Profile::add_idle(double milliseconds, std::uint64_t gaps) {
    const std::lock_guard lock(mutex_);
    idle_ms_ += milliseconds;
    gaps_ += gaps;
}

void Profile::reset() {
    const std::lock_guard lock(mutex_);
    entries_.clear();
    idle_ms_ = 0;
    gaps_ = 0;
}

std::vector<Profile::Row> Profile::rows() const {
    std::vector<Row> rows;
    for (const auto& [key, entry] : entries_) {
        std::vector<float> times = entry.times_ms;
        const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
        std::nth_element(times.begin(), middle, times.end());
        rows.push_back({&key, &entry, static_cast<double>(*middle)});
    }
    std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
        return a.entry->total_ms > b.entry->total_ms;
    });
    return rows;
}

std::string Profile::json(const std::string& device) const {
    const std::lock_guard lock(mutex_);
    JsonWriter json;
    json.begin_object().member("device", device).newline(1).key("ops").begin_array();
    for (const Row& row : rows()) {
        const auto count = static_cast<double>(row.entry->count);
        json.newline(2).begin_object().member("op", row.key->first);
        json.member("kernel", row.key->second).member("count", row.entry->count);
        json.key("total_ms").number(row.entry->total_ms, 9);
        json.key("min_ms").number(row.entry->min_ms, 9);
        json.key("median_ms").number(row.median_ms, 9);
        json.member("bytes", row.entry->work.bytes / count);
        json.member("flops", row.entry->work.flops / count).end();
    }
    json.end().newline(1).key("idle").begin_object().member("count", gaps_).key("total_ms");
    json.number(idle_ms_, 9).end().end();
    return json.text();
}

std::string Profile::table(const std::string& device) const {
    const std::lock_guard lock(mutex_);
    std::string text = "device: " + device + "\n";
    text += format("%-28s %-32s %8s %10s %10s %10s %8s %8s\n", "op", "kernel", "count", "total ms",
                   "min ms", "median ms", "GB/s", "GFLOP/s");
    for (const Row& row : rows()) {
        const double seconds = row.entry->total_ms * 1e-3;
        const auto rate = [seconds](double amount) {
            return seconds > 0 ? amount / seconds * 1e-9 : 0.0;
        };
        text +=
            format("%-28s %-32s %8llu %10.3f %10.4f %10.4f %8.2f %8.2f\n", row.key->first.c_str(),
                   row.key->second.c_str(), static_cast<unsigned long long>(row.entry->count),
                   row.entry->total_ms, row.entry->min_ms, row.median_ms,
                   rate(row.entry->work.bytes), rate(row.entry->work.flops));
    }
    text += format("%-28s %-32s %8llu %10.3f\n", "between dispatches", "",
                   static_cast<unsigned long long>(gaps_), idle_ms_);
    return text;
}

}  // namespace splat::vk
