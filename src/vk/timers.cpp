#include "vk/timers.h"

#include <algorithm>

#include "core/json_writer.h"

namespace splat::vk {

std::vector<PieceSpan> timed_spans(const std::vector<Command>& commands,
                                   const std::vector<Piece>& pieces,
                                   const std::vector<PieceSpan>& segments, bool alone) {
    std::vector<PieceSpan> spans;
    for (const PieceSpan& segment : segments) {
        bool open = false;
        for (std::size_t i = segment.first; i < segment.last; ++i) {
            if (is_barrier(commands[pieces[i].command])) {
                open = false;
            } else if (open && !alone) {
                spans.back().last = i + 1;
            } else {
                spans.push_back({i, i + 1});
                open = true;
            }
        }
    }
    return spans;
}

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

void Profile::add_list(const ListTotals& totals) {
    const std::lock_guard lock(mutex_);
    ++lists_;
    totals_.submits += totals.submits;
    totals_.dispatches += totals.dispatches;
    totals_.copies += totals.copies;
    totals_.barriers += totals.barriers;
    totals_.transfer_barriers += totals.transfer_barriers;
    totals_.host_barriers += totals.host_barriers;
    totals_.gaps += totals.gaps;
    totals_.idle_ms += totals.idle_ms;
    totals_.device_ms += totals.device_ms;
    totals_.longest_submit_ms = std::max(totals_.longest_submit_ms, totals.longest_submit_ms);
}

void Profile::add_read(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    ++transfers_.reads;
    transfers_.read_bytes += bytes;
}

void Profile::add_write(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    ++transfers_.writes;
    transfers_.written_bytes += bytes;
}

void Profile::reset() {
    const std::lock_guard lock(mutex_);
    entries_.clear();
    totals_ = {};
    transfers_ = {};
    lists_ = 0;
}

std::vector<Profile::Row> Profile::rows() const {
    std::vector<Row> rows;
    for (const auto& [key, entry] : entries_) {
        std::vector<float> times = entry.times_ms;
        const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
        std::nth_element(times.begin(), middle, times.end());
        rows.push_back({&key, &entry, static_cast<double>(*middle)});
    }
    std::ranges::stable_sort(
        rows, [](const Row& a, const Row& b) { return a.entry->total_ms > b.entry->total_ms; });
    return rows;
}

std::string Profile::json(const std::string& device) const {
    const std::lock_guard lock(mutex_);
    JsonWriter json;
    json.begin_object().member("device", device).newline(1).key("ops").begin_array();
    double bytes = 0;
    for (const Row& row : rows()) {
        const auto count = static_cast<double>(row.entry->count);
        bytes += row.entry->work.bytes;
        json.newline(2).begin_object().member("op", row.key->first);
        json.member("kernel", row.key->second).member("count", row.entry->count);
        json.key("total_ms").number(row.entry->total_ms, 9);
        json.key("min_ms").number(row.entry->min_ms, 9);
        json.key("median_ms").number(row.median_ms, 9);
        json.member("bytes", row.entry->work.bytes / count);
        json.member("flops", row.entry->work.flops / count).end();
    }
    json.end().newline(1).key("idle").begin_object().member("count", totals_.gaps);
    json.key("total_ms").number(totals_.idle_ms, 9).end();
    json.newline(1).key("lists").begin_object().member("count", lists_);
    json.member("submits", totals_.submits).member("dispatches", totals_.dispatches);
    json.member("copies", totals_.copies);
    json.member("barriers", totals_.barriers);
    json.member("compute_barriers", totals_.levels() - totals_.transfer_barriers);
    json.member("transfer_barriers", totals_.transfer_barriers);
    json.member("host_barriers", totals_.host_barriers).member("levels", totals_.levels());
    json.member("bytes", bytes);
    json.key("device_ms").number(totals_.device_ms, 9);
    json.key("longest_submit_ms").number(totals_.longest_submit_ms, 9).end();
    json.newline(1).key("transfers").begin_object().member("reads", transfers_.reads);
    json.member("read_bytes", transfers_.read_bytes).member("writes", transfers_.writes);
    json.member("written_bytes", transfers_.written_bytes).end().end();
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
        text += format("%-28s %-32s %8llu %10.3f %10.4f %10.4f %8.2f %8.2f\n",
                       row.key->first.c_str(), row.key->second.c_str(), llu(row.entry->count),
                       row.entry->total_ms, row.entry->min_ms, row.median_ms,
                       rate(row.entry->work.bytes), rate(row.entry->work.flops));
    }
    text += format("%-28s %-32s %8llu %10.3f\n", "between dispatches", "", llu(totals_.gaps),
                   totals_.idle_ms);
    const auto count = [](std::uint64_t n) { return llu(n); };
    text += format(
        "%llu lists: %llu submits, %llu dispatches, %llu fills and copies, %llu barriers (%llu of "
        "transfers, %llu to the host), %llu levels, %.3f ms from first to last; the longest submit "
        "took %.3f ms\n",
        count(lists_), count(totals_.submits), count(totals_.dispatches), count(totals_.copies),
        count(totals_.barriers), count(totals_.transfer_barriers), count(totals_.host_barriers),
        count(totals_.levels()), totals_.device_ms, totals_.longest_submit_ms);
    text += format("%llu reads of %llu bytes, %llu writes of %llu bytes\n", count(transfers_.reads),
                   count(transfers_.read_bytes), count(transfers_.writes),
                   count(transfers_.written_bytes));
    return text;
}

}  // namespace splat::vk
