// Imports that several processes do in parts, and the last of which completes the store.
#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "support/system.h"
#include "synthetic/sample_folder.h"
#include "tables/published_tables.h"
#include "tables/store.h"
#include "tables/table_samples.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;
using namespace test;

StoreIndex small_index(const std::string& source) {
    StoreIndex index;
    index.split = "train";
    index.source = source;
    index.resolution = 1;
    index.maps = {Table::kRgb};
    index.objects = {{"a", "4 2 2 0\n0 0 0\n1\n1 1\n", 5}};
    index.frames = {0, 1, 2, 3, 4};
    return index;
}

Status write_part(const fs::path& folder, Part part, const std::string& source = "x") {
    SPLAT_ASSIGN(const auto store,
                 StoreWriter::open(folder.string(), small_index(source), true, part));
    if (store->complete()) return {};
    for (std::uint64_t row = part.begin(5); row < part.end(5); ++row) {
        const std::byte pixel[3] = {std::byte{1}, std::byte{2}, static_cast<std::byte>(row)};
        SPLAT_TRY(store->put(Table::kPoses, row, {}));
        SPLAT_TRY(store->put(Table::kRgb, row, pixel));
    }
    return store->finish();
}

TEST(StoreWriter, LeavesFilesOfOthers) {
    const SampleFolder folder;
    const auto refused = [&](const char* name) {
        const fs::path full = folder / ("with_" + std::string(name));
        put_text(full / name, "mine");
        put_text(full / "rgb.npy", "photographs");
        EXPECT_ERROR(write_part(full, {}), Code::kInvalidArgument, "is there and is no store");
        EXPECT_EQ(file_text(full / name), "mine");
        EXPECT_EQ(file_text(full / "rgb.npy"), "photographs");
    };
    for (const char* name : {"importance.csv", "import.log", "import_1_of_2.json.bak", "imports",
                             "lockers.csv", "store.json"})
        refused(name);
    const fs::path begun = folder / "begun";
    for (const char* name : {"import.log", "imports/a", "import_0_of_2.json.7-0.tmp"})
        put_text(begun / name, "mine");
    put_text(begun / "import.json", "{\"source\": \"y\", \"done\": {}}");
    ASSERT_OK(write_part(begun, {}));
    EXPECT_TRUE(is_store(begun.string()).value());
    EXPECT_TRUE(fs::exists(begun / "import.log"));
    EXPECT_TRUE(fs::exists(begun / "imports/a"));
    EXPECT_FALSE(fs::exists(begun / "import_0_of_2.json.7-0.tmp"));
    EXPECT_FALSE(fs::exists(begun / "import.json"));
}

TEST(StoreWriter, RefusesNamesThatAreNotUtf8BeforeItBegins) {
    const SampleFolder folder;
    StoreIndex index = small_index("x");
    index.objects[0].name = "b\xFCste";
    EXPECT_ERROR(StoreWriter::open((folder / "store").string(), index, false),
                 Code::kInvalidArgument, "the object 'b\\xfcste' is not UTF-8");
    EXPECT_FALSE(fs::exists(folder / "store"));
}

TEST(Shards, CoverEveryRowOnce) {
    for (const std::uint64_t rows : {0, 1, 5, 1000}) {
        std::uint64_t next = 0;
        for (std::uint32_t i = 0; i < 7; ++i) {
            EXPECT_EQ((Part{i, 7}.begin(rows)), next);
            next = Part{i, 7}.end(rows);
        }
        EXPECT_EQ(next, rows);
    }
}

TEST(Shards, TheLastOneCompletesTheStore) {
    const SampleFolder folder;
    ASSERT_OK(write_part(folder / "whole", {}));
    for (const auto& order : {std::vector<std::uint32_t>{0, 1, 2}, {2, 0, 1}, {1, 1, 2, 0}}) {
        const fs::path parts = folder / "parts";
        for (const std::uint32_t i : order) {
            EXPECT_FALSE(is_store(parts.string()).value()) << "before part " << i;
            ASSERT_OK(write_part(parts, {i, 3}));
        }
        EXPECT_TRUE(is_store(parts.string()).value());
        EXPECT_TRUE(tree_of(parts, {".npy", ".json"}) ==
                    tree_of(folder / "whole", {".npy", ".json"}));
        EXPECT_OK(write_part(parts, {1, 3})) << "a complete store is left alone";
        fs::remove_all(parts);
    }
}

TEST(Shards, AreWrittenBySeveralProcessesAtOnce) {
    SPLAT_NEED_FORK();
    constexpr std::uint32_t kParts = 5;
    const SampleFolder folder;
    ASSERT_OK(write_part(folder / "whole", {}));
    std::vector<test::Child> children;
    for (std::uint32_t i = 0; i < kParts; ++i)
        children.emplace_back([&] {
            return write_part(folder / "parts", {i, kParts}).ok() ? 0 : 1;
        });
    for (const test::Child& child : children) EXPECT_EQ(child.wait(), 0);
    EXPECT_TRUE(tree_of(folder / "parts", {".npy", ".json"}) ==
                tree_of(folder / "whole", {".npy", ".json"}));
}

TEST(Shards, ThatDoNotFitAreRefused) {
    const SampleFolder folder;
    const fs::path store = folder / "store";
    ASSERT_OK(write_part(store, {0, 3}));
    EXPECT_ERROR(write_part(store, {1, 2}), Code::kInvalidArgument,
                 "import_0_of_3.json': the same import, begun in another number of shards");
    EXPECT_ERROR(write_part(store, {}), Code::kInvalidArgument, "another number of shards");
    {
        const auto held = StoreWriter::open(store.string(), small_index("x"), false, {1, 3});
        ASSERT_OK(held);
        EXPECT_ERROR(write_part(store, {1, 3}), Code::kInvalidState, "shard 1 of 3 of ");
        EXPECT_ERROR(write_part(store, {}), Code::kInvalidState, "is in use");
        EXPECT_OK(write_part(store, {2, 3})) << "another shard is not in the way";
    }
    EXPECT_FALSE(is_store(store.string()).value());
    // Parts of other tables begin anew, and do not count what was done of the first.
    ASSERT_OK(write_part(store, {1, 3}, "y"));
    ASSERT_OK(write_part(store, {2, 3}, "y"));
    EXPECT_FALSE(is_store(store.string()).value());
    ASSERT_OK(write_part(store, {0, 3}, "y"));
    EXPECT_TRUE(is_store(store.string()).value());
}

TEST(Shards, OfEarlierVersionsCount) {
    const SampleFolder folder;
    const fs::path store = folder / "store";
    ASSERT_OK(write_part(store, {0, 2}));
    put_text(store / "import_0_of_2.json", R"({"source": "x", "done": {"all": 1, "rgbs 0": 3}})");
    ASSERT_OK(write_part(store, {1, 2}));
    EXPECT_TRUE(is_store(store.string()).value());
}

TEST(Shards, ParquetTablesAreImportedInParts) {
    SPLAT_NEED_DUCKDB();
    const CarsFolder folder;
    const fs::path tables = folder / "tables";
    ASSERT_OK(convert(folder / "srn", "train", data::Layout::kTables, tables));
    const auto import = [&](const char* to, Part part) {
        return import_tables({tables.string(), "train", (folder / to).string(), "", false, part},
                             nullptr);
    };
    ASSERT_OK(import("whole", {}));
    for (const std::uint32_t i : {3U, 0U, 2U, 1U}) {
        EXPECT_FALSE(is_store((folder / "parts").string()).value());
        ASSERT_OK(import("parts", {i, 4}));
    }
    EXPECT_TRUE(tree_of(folder / "parts", {".npy", ".json"}) ==
                tree_of(folder / "whole", {".npy", ".json"}));
}

}  // namespace
}  // namespace splat::tables
