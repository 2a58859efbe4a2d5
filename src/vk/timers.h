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

/// Pieces [first, last) of a list.
struct PieceSpan {
    std::size_t first;
    std::size_t last;
};

/// What two timestamps enclose: each piece alone, or all pieces between two barriers of a submit, which may
/// overlap on a GPU; timestamps around each would serialise them.
std::vector<PieceSpan> timed_spans(const std::vector<Command>& commands,
                                   const std::vector<Piece>& pieces,
                                   const std::vector<PieceSpan>& segments, bool alone);

/// What one run of a command list did.
struct ListTotals {
    std::uint64_t submits = 0;
    std::uint64_t dispatches = 0;  ///< counts each piece of a split one
    std::uint64_t copies = 0;      ///< copies and fills
    std::uint64_t barriers = 0;    ///< all kinds: one before each level, and those to the host
    std::uint64_t transfer_barriers = 0;  ///< naming fills and copies
    std::uint64_t host_barriers = 0;
    std::uint64_t gaps = 0;        ///< between commands, or levels of them, that were timed
    double idle_ms = 0;            ///< in the gaps
    double device_ms = 0;          ///< from the first command's beginning to the last one's end
    double longest_submit_ms = 0;  ///< on the host's clock

    /// Dispatches, fills and copies between two barriers are one level.
    [[nodiscard]] std::uint64_t levels() const { return barriers - host_barriers; }
};

/// Copies between host memory and buffers, one of each call.
struct TransferTotals {
    std::uint64_t reads = 0;
    std::uint64_t read_bytes = 0;
    std::uint64_t writes = 0;
    std::uint64_t written_bytes = 0;
};

/// Device times of dispatches, by operator label and shader. Thread-safe. Dispatches that no barrier separates may
/// overlap: on GPUs they are timed together, and each gets a share by its estimated time.
class Profile {
  public:
    void add(std::string_view op, std::string_view shader, double milliseconds, const Work& work);
    void add_list(const ListTotals& totals);
    void add_read(std::uint64_t bytes);
    void add_write(std::uint64_t bytes);
    void reset();

    /// {"device": …, "ops": [{"op", "kernel", "count", "total_ms", "min_ms", "median_ms", "bytes", "flops"}],
    /// "idle": {"count", "total_ms"}, "lists": {"count", "submits", "dispatches", "copies", "barriers",
    /// "compute_barriers", "transfer_barriers", "host_barriers", "levels", "bytes", "device_ms",
    /// "longest_submit_ms"}, "transfers": {"reads", "read_bytes", "writes", "written_bytes"}}, longest first; an
    /// operator's bytes and flops are means over the dispatches.
    [[nodiscard]] std::string json(const std::string& device) const;
    /// The same as a table, with rates over the total time.
    [[nodiscard]] std::string table(const std::string& device) const;

  private:
    struct Entry {
        std::vector<float> times_ms;  ///< the latest kMaxTimes
        std::uint64_t count = 0;
        double total_ms = 0;
        double min_ms = 0;
        Work work;  ///< work of all dispatches
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
    ListTotals totals_;
    TransferTotals transfers_;
    std::uint64_t lists_ = 0;
};

}  // namespace splat::vk
