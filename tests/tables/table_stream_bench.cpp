// Usage: table_stream_bench FOLDER FRAMES [GROUP]
//
// Writes tables of 128 x 128 pixels in row groups of GROUP rows (512), imports them, and reads all of the store as
// a training would; prints MB/s of raw pixels of each step and the peak memory. Exit status: 0; 1 a step failed or
// took more than 512 MiB; 77 no DuckDB library.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "core/rng.h"
#include "data/dataset.h"
#include "support/system.h"
#include "tables/import.h"
#include "tables/table_writer.h"

namespace {

namespace fs = std::filesystem;
using namespace splat;
using tables::Table;

constexpr std::uint64_t kViews = 50;  ///< views of an object, as in SRN's training split
constexpr std::size_t kBytes = 3 * 128 * 128;
constexpr double kMaxMiB = 512;

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

using test::processor_seconds;

double peak_mib() {
    return static_cast<double>(test::peak_bytes()) / (1 << 20);
}

/// Rows in an order that is not that of the ids. Pixels pack about as well as renders do.
class Frames {
  public:
    Frames(Table table, std::uint64_t frames) : table_(table), frames_(frames), blob_(kBytes) {}

    bool next(std::vector<tables::Cell>& cells) {
        if (row_ == frames_) return false;
        const std::uint64_t objects = table_ == Table::kIntrinsics ? frames_ : frames_ / kViews;
        const std::uint64_t object = (table_ == Table::kIntrinsics ? row_ : row_ / kViews) * 7919;
        uuid_ = format("%032llx", static_cast<unsigned long long>(object % objects));
        cells[0] = std::string_view(uuid_);
        if (table_ == Table::kIntrinsics) {
            cells[1] = std::string_view("131.25 64 64 0\n0 0 0\n1\n128 128\n");
        } else {
            cells[1] = static_cast<std::int64_t>(kViews - 1 - row_ % kViews);
            if (table_ == Table::kPoses)
                cells[2] = std::string_view("1 0 0 0 0 1 0 0 0 0 1 -1.3 0 0 0 1");
            else
                cells[2] = pixels();
        }
        ++row_;
        return true;
    }

  private:
    std::string_view pixels() {
        auto state = static_cast<std::uint32_t>(row_ * 2654435761U);
        for (std::size_t i = 0; i < kBytes; i += 4) {
            if (i % 64 < 12) state = state * 1664525U + 1013904223U;
            std::memcpy(&blob_[i], &state, 4);
        }
        return {blob_.data(), blob_.size()};
    }

    Table table_;
    std::uint64_t frames_, row_ = 0;
    std::string uuid_;
    std::vector<char> blob_;
};

Status write_tables(const std::string& folder, std::uint64_t frames, std::size_t group) {
    SPLAT_ASSIGN(const auto session, tables::Session::open("", {folder}));
    for (const Table table : {Table::kIntrinsics, Table::kPoses, Table::kRgb}) {
        Frames rows(table, table == Table::kIntrinsics ? frames / kViews : frames);
        const std::string name = tables::kind_of(table).name;
        fs::create_directories(folder + "/" + name + "/train");
        SPLAT_TRY(session->write_parquet(
            folder + "/" + name + "/train/" + name + ".parquet", tables::columns_of(table),
            [&rows](std::vector<tables::Cell>& cells) -> Result<bool> { return rows.next(cells); },
            group));
    }
    return {};
}

Status read_all(const std::string& folder) {
    data::DatasetDesc desc;
    desc.path = folder;
    desc.cache_bytes = 1;
    SPLAT_ASSIGN(const auto dataset, data::Dataset::open(desc));
    std::vector<std::uint32_t> views(kViews);
    for (std::uint32_t i = 0; i < kViews; ++i) views[i] = i;
    std::vector<float> images(kViews * kBytes);
    for (std::uint32_t object = 0; object < dataset->index().names.size(); ++object) {
        SPLAT_TRY(dataset->read(object, views, {.images = images.data()}));
    }
    return {};
}

/// Wall and processor time at the start of a step.
struct Start {
    double wall = seconds(), processor = processor_seconds();
};

int report(const char* step, const Status& status, const Start& start, std::uint64_t frames) {
    const double took = seconds() - start.wall;
    const double worked = processor_seconds() - start.processor;
    if (!status.ok()) {
        std::printf("%s: %s\n", step, status.message().c_str());
        return 1;
    }
    const double megabytes = static_cast<double>(frames * kBytes) * 1e-6;
    std::printf("%-7s %7.1f s, %.0f MB/s; of processor time %.0f MB/s; peak so far %.0f MiB\n",
                step, took, megabytes / took, megabytes / worked, peak_mib());
    return peak_mib() <= kMaxMiB ? 0 : 1;
}

}  // namespace

int main(int count, char** words) {
    if (count < 3) return 2;
    if (const auto found = tables::duckdb_library(""); !found.ok()) {
        std::printf("skipped: %s\n", found.status().message().c_str());
        return 77;
    }
    const std::string folder = words[1];
    const std::uint64_t frames = std::strtoull(words[2], nullptr, 10) / kViews * kViews;
    fs::remove_all(folder);
    fs::create_directories(folder);
    Start start;
    int failed =
        report("write",
               write_tables(folder, frames, count > 3 ? std::strtoull(words[3], nullptr, 10) : 512),
               start, frames);
    start = Start();
    if (failed == 0)
        failed = report(
            "import",
            tables::import_tables({folder, "train", folder + "/.splat/train", "", false}, nullptr),
            start, frames);
    start = Start();
    if (failed == 0) failed = report("stream", read_all(folder), start, frames);
    fs::remove_all(folder);
    return failed;
}
