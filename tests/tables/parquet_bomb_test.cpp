// Small tables that ask for all memory, the disk or hours. Each is imported in a process of its own, whose peak of
// memory and time are printed.
#include <gtest/gtest.h>

#include "support/child_cost.h"
#include "support/expect_status.h"
#include "synthetic/sample_folder.h"
#include "tables/import.h"
#include "tables/published_tables.h"
#include "tables/table_files.h"
#include "tables/table_samples.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double kScale = 20;  ///< multiplies time and memory
#else
constexpr double kScale = 1;
#endif
constexpr double kMostSeconds = 5;
constexpr double kMostBytes = double{512U << 20U};  ///< promised by import_tables()
constexpr std::uint64_t kMostDiskBytes = 64U << 20U;

std::uint64_t bytes_below(const fs::path& folder) {
    std::uint64_t bytes = 0;
    std::error_code none;
    for (const auto& entry : fs::recursive_directory_iterator(folder, none))
        if (entry.is_regular_file()) bytes += entry.file_size();
    return bytes;
}

/// Imports the tables; the error holds `part`.
void expect_harmless(const char* name, const test::PublishedTables& tables, std::string_view part) {
    const test::SampleFolder folder;
    ASSERT_OK(tables.write(folder.path(), ", COMPRESSION zstd"));
    const fs::path store = folder / "store";
    const test::ChildCost cost = test::cost_of([&] {
        const Status status =
            import_tables({folder.path().string(), "train", store.string(), "", false}, nullptr);
        return status.ok() ? "imported" : code_name(status.code()) + (": " + status.message());
    });
    const auto files = need(find_tables(folder.path().string(), "train"));
    const std::uint64_t disk = bytes_below(store);
    std::printf("%-12s %8llu bytes: %5.0f MB, %5.0f MB of disk, %5.2f s: %.200s\n", name,
                static_cast<unsigned long long>(bytes_of(files)),
                static_cast<double>(cost.bytes) / 1e6, static_cast<double>(disk) / 1e6,
                cost.seconds, cost.answer.c_str());
    EXPECT_HAS(cost.answer, part);
    EXPECT_LE(static_cast<double>(cost.bytes), kMostBytes * kScale);
    EXPECT_LE(cost.seconds, kMostSeconds * kScale);
    EXPECT_LE(disk, kMostDiskBytes);
}

TEST(DecodeBomb, ParquetOfLongIntrinsics) {
    SPLAT_NEED_DUCKDB();
    test::PublishedTables tables;
    tables.selects["intrins"] =
        "SELECT 'o' || i AS uuid, E'4 2 2 0\\n0 0 0\\n1\\n4 4\\n' || repeat(' ', 1000000) AS "
        "intrinsics FROM range(1000) t(i)";
    expect_harmless("intrinsics", tables, "bytes, expected at most 512");
}

TEST(DecodeBomb, ParquetOfManyObjects) {
    SPLAT_NEED_DUCKDB();
    test::PublishedTables tables;
    tables.selects["intrins"] =
        "SELECT 'o' || i AS uuid, E'4 2 2 0\\n0 0 0\\n1\\n4 4\\n' AS intrinsics "
        "FROM range(2000000) t(i)";
    expect_harmless("objects", tables, "bytes are too many for a file of");
}

TEST(DecodeBomb, ParquetOfManyRows) {
    SPLAT_NEED_DUCKDB();
    test::PublishedTables tables;
    tables.selects["poses"] =
        "SELECT 'a' AS uuid, 0 AS frame_id, '1 0 0 0 0 1 0 0 0 0 1 -1 0 0 0 1' AS pose "
        "FROM range(20000000)";
    expect_harmless("rows", tables, "bytes are too many for a file of");
}

TEST(DecodeBomb, ParquetOfLongFrameIds) {
    SPLAT_NEED_DUCKDB();
    test::PublishedTables tables;
    tables.selects["poses"] =
        "SELECT 'a' AS uuid, repeat('0', 1000000) AS frame_id, "
        "'1 0 0 0 0 1 0 0 0 0 1 -1 0 0 0 1' AS pose FROM range(4096)";
    expect_harmless("frame ids", tables, "column frame_id, row 0");
}

/// An SQL blob of a black image, which takes few bytes.
std::string black_png(std::uint32_t side) {
    return test::png_literal(
        {side, side, 3, 8, std::vector<std::uint16_t>(std::size_t{3} * side * side)});
}

TEST(DecodeBomb, ParquetOfManyPixels) {
    SPLAT_NEED_DUCKDB();
    test::PublishedTables tables;
    tables.selects.erase("depths");
    tables.selects.erase("normals");
    tables.selects["rgbs"] = "SELECT uuid, frame_id, {'bytes': " + black_png(3000) +
                             ", 'path': ''} AS rgb FROM (" + tables.selects["rgbs"] + ")";
    expect_harmless("pixels", tables,
                    "a store of images of 3000 pixels a side: 6 x 27000000 bytes");
}

TEST(DecodeBomb, ParquetOfOneLargeImage) {
    SPLAT_NEED_DUCKDB();
    test::PublishedTables tables;
    tables.selects["rgbs"] = "SELECT uuid, frame_id, {'bytes': CASE WHEN frame_id = 2 THEN " +
                             black_png(4) + " ELSE " + black_png(1000) +
                             " END, 'path': ''} AS rgb FROM (" + tables.selects["rgbs"] + ")";
    expect_harmless("one image", tables, "1000 x 1000 pixels, expected 4 x 4");
}

}  // namespace
}  // namespace splat::tables
