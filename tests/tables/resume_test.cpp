// Imports and exports that a signal, a full disk or the caller ends, and that go on.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>

#include "core/fault.h"
#include "support/expect_status.h"
#include "support/system.h"
#include "synthetic/sample_folder.h"
#include "tables/published_tables.h"
#include "tables/store.h"
#include "tables/table_samples.h"
#include "tables/table_writer.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;
using data::Layout;
using namespace test;

/// 512 frames of 256 x 256 pixels are 100 MB: several entries of the journal.
constexpr std::uint64_t kFrames = 512;
constexpr std::size_t kSide = 256;

Status write_large(const fs::path& folder) {
    SPLAT_ASSIGN(const auto session, Session::open("", {folder.string()}));
    std::string pixels(3 * kSide * kSide, 0);
    for (const Table table : {Table::kIntrinsics, Table::kPoses, Table::kRgb}) {
        std::uint64_t row = 0;
        const auto next = [&](std::vector<Cell>& cells) -> Result<bool> {
            if (row == (table == Table::kIntrinsics ? 1 : kFrames)) return false;
            cells[0] = std::string_view("car");
            if (table == Table::kIntrinsics)
                cells[1] = std::string_view("300 128 128 0\n0 0 0\n1\n256 256\n");
            else
                cells[1] = static_cast<std::int64_t>(kFrames - 1 - row);
            std::fill(pixels.begin(), pixels.end(), static_cast<char>(row * 7));
            if (table == Table::kPoses)
                cells[2] = std::string_view("1 0 0 0 0 1 0 0 0 0 1 -1 0 0 0 1");
            if (table == Table::kRgb) cells[2] = std::string_view(pixels);
            ++row;
            return true;
        };
        const std::string name = kind_of(table).name;
        SPLAT_TRY(write_table_file(
            *session, (folder / name / "train" / (name + ".parquet")).string(), table, next, 64));
    }
    return {};
}

Status import_to_store(const fs::path& folder, const Progress& progress) {
    return import_tables({folder.string(), "train", (folder / "store").string(), "", false},
                         progress);
}

constexpr int kKill = 9;  ///< SIGKILL, which Windows, where these tests are skipped, does not name

/// Runs in a child that kills itself; true if it did.
bool killed(const std::function<void()>& work) {
    return in_child([&] { return work(), 0; }) == -kKill;
}

Progress kill_after(std::uint64_t rows) {
    return [rows](std::uint64_t done, std::uint64_t) -> Status {
        if (done >= rows) std::raise(kKill);
        return {};
    };
}

TEST(Resume, ParquetImportGoesOnAfterKill) {
    SPLAT_NEED_DUCKDB();
    SPLAT_NEED_FORK();
    const SampleFolder folder;
    ASSERT_OK(write_large(folder.path()));
    ASSERT_TRUE(
        killed([&] { static_cast<void>(import_to_store(folder.path(), kill_after(960))); }));
    EXPECT_FALSE(is_store((folder / "store").string()).value());
    std::uint64_t first = 0;  // row of rgb, after those of poses
    ASSERT_OK(
        import_to_store(folder.path(), [&](std::uint64_t done, std::uint64_t total) -> Status {
            if (first == 0 && done > kFrames) first = done - kFrames;
            EXPECT_LE(done, total);
            return {};
        }));
    EXPECT_GT(first, 320U) << "rows before the last entry of the journal were read again";
    const std::string resumed = tree_of(folder / "store", {".npy", ".json"});
    fs::remove_all(folder / "store");
    ASSERT_OK(import_to_store(folder.path(), nullptr));
    EXPECT_TRUE(resumed == tree_of(folder / "store", {".npy", ".json"}));
    fs::remove_all(folder / "rgbs/train");
    EXPECT_ERROR(import_to_store(folder.path(), nullptr), Code::kFormat, "rgbs");
}

TEST(Resume, ParquetImportRepeatsRowsThatTheDiskLost) {
    SPLAT_NEED_DUCKDB();
    SPLAT_NEED_FORK();
    const SampleFolder folder;
    ASSERT_OK(write_large(folder.path()));
    ASSERT_TRUE(
        killed([&] { static_cast<void>(import_to_store(folder.path(), kill_after(960))); }));
    {
        std::fstream file(folder / "store/rgb.npy",
                          std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(-1000, std::ios::end);  // the first row of the table is the last of the store
        file << "lost";
    }
    ASSERT_OK(import_to_store(folder.path(), nullptr));
    const std::string resumed = tree_of(folder / "store", {".npy"});
    fs::remove_all(folder / "store");
    ASSERT_OK(import_to_store(folder.path(), nullptr));
    EXPECT_TRUE(resumed == tree_of(folder / "store", {".npy"}));
}

TEST(Resume, ParquetExportGoesOnAfterKill) {
    SPLAT_NEED_DUCKDB();
    SPLAT_NEED_FORK();
    const CarsFolder folder;
    const auto go = [&](const char* to, const Progress& progress) {
        return convert(folder / "srn", "train", Layout::kTables, folder / to, progress);
    };
    ASSERT_OK(go("whole", nullptr));
    // 6 rows of each table: poses and rgbs are complete, depths is begun.
    ASSERT_TRUE(killed([&] { static_cast<void>(go("out", kill_after(15))); }));
    const fs::path rgb = folder / "out/rgbs/train/rgbs.parquet";
    const auto written = fs::last_write_time(rgb);
    ASSERT_OK(go("out", nullptr));
    EXPECT_EQ(written, fs::last_write_time(rgb));
    EXPECT_TRUE(tree_of(folder / "whole", {".parquet", ".json", ".md"}) ==
                tree_of(folder / "out", {".parquet", ".json", ".md"}));
    for (const auto& entry : fs::recursive_directory_iterator(folder / "out"))
        EXPECT_NE(entry.path().extension(), ".tmp") << entry.path();
}

TEST(Resume, ExportEndsWhileItLooksAtItsFiles) {
    const CarsFolder folder;
    for (const Layout to : {Layout::kStore, Layout::kSrn, Layout::kImages}) {
        const auto stop = [](std::uint64_t done, std::uint64_t) {
            return done > 0 ? Status() : Status(Code::kCancelled, "at the first object");
        };
        EXPECT_ERROR(convert(folder / "srn", "train", to, folder / "out", stop), Code::kCancelled,
                     "at the first object");
        EXPECT_FALSE(fs::exists(folder / "out"));
    }
}

TEST(Resume, ParquetExportWithAChangedByteIsRefused) {
    SPLAT_NEED_DUCKDB();
    const CarsFolder folder;
    const fs::path out = folder / "out";
    ASSERT_OK(convert(folder / "srn", "val", Layout::kTables, out));
    const fs::path file = out / "depths/val/depths.parquet";
    std::string bytes = file_text(file);
    bytes[bytes.size() / 3] = static_cast<char>(bytes[bytes.size() / 3] ^ 1);
    std::ofstream(file, std::ios::binary) << bytes;
    EXPECT_ERROR(convert(out, "val", Layout::kSrn, folder / "back"), Code::kFormat,
                 "depths/val/depths.parquet' is not the file of");
    ASSERT_OK(convert(folder / "srn", "val", Layout::kTables, out));
    ASSERT_OK(convert(out, "val", Layout::kSrn, folder / "back"));
}

TEST(Resume, ParquetImportEndsWithTheCallersError) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    ASSERT_OK(PublishedTables().write(folder.path()));
    EXPECT_ERROR(import_to_store(folder.path(),
                                 [](std::uint64_t, std::uint64_t) {
                                     return Status(Code::kCancelled, "enough");
                                 }),
                 Code::kCancelled, "enough");
    ASSERT_OK(import_to_store(folder.path(), nullptr));
}

TEST(Resume, ParquetImportOntoAFullDiskGoesOnWithSpace) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    ASSERT_OK(PublishedTables().write(folder.path()));
    fault::arm("tables.allocate", 1);
    EXPECT_ERROR(import_to_store(folder.path(), nullptr), Code::kIo, "No space left on device");
    fault::disarm();
    for (std::uint64_t hit = 1;; ++hit) {
        fault::arm("tables.write", hit);
        const Status status = import_to_store(folder.path(), nullptr);
        if (fault::disarm() < hit) {
            EXPECT_OK(status);
            EXPECT_GE(hit, 20U) << "rows of earlier tries are not written again";
            break;
        }
        EXPECT_ERROR(status, Code::kIo, "No space left on device");
        EXPECT_FALSE(is_store((folder / "store").string()).value());
    }
}

TEST(Resume, ParquetExportOntoAFullDiskLeavesNoTable) {
    SPLAT_NEED_FILE_LIMIT();
    SPLAT_NEED_DUCKDB();
    const CarsFolder folder;
    const Status status = [&] {
        const FileLimit small(2048);
        return convert(folder / "srn", "train", Layout::kTables, folder / "out");
    }();
    EXPECT_ERROR(status, Code::kIo, "cannot write");
    EXPECT_EQ(tree_of(folder / "out/rgbs", {".parquet", ".tmp"}), "");
    EXPECT_OK(convert(folder / "srn", "train", Layout::kTables, folder / "out"));
}

/// The store of one object.
StoreIndex index_of_two_views() {
    StoreIndex index;
    index.split = "train";
    index.source = "x";
    index.resolution = 4;
    index.maps = {Table::kRgb};
    index.objects = {{"a", "4 2 2 0\n0 0 0\n1\n4 4\n", 2}};
    index.frames = {0, 1};
    return index;
}

TEST(Resume, StoreInUseIsRefused) {
    const SampleFolder folder;
    const StoreIndex index = index_of_two_views();
    const std::string path = (folder / "store").string();
    {
        const auto held = StoreWriter::open(path, index, false);
        ASSERT_OK(held);
        EXPECT_ERROR(StoreWriter::open(path, index, false), Code::kInvalidState,
                     "another process imports into it");
    }
    EXPECT_OK(StoreWriter::open(path, index, false));
    put_text(folder / "full/photo.txt", "mine");
    EXPECT_ERROR(StoreWriter::open((folder / "full").string(), index, false),
                 Code::kInvalidArgument, "is no store");
}

/// Wherever the removal of another import ends, complete or begun, the folder is taken again.
TEST(Resume, StoreIsTakenAfterItsClearingEnded) {
    for (const bool complete : {false, true}) {
        std::uint64_t removed = 0;
        for (std::uint64_t hit = 1; hit == 1 || removed >= hit - 1; ++hit) {
            const SampleFolder folder;
            const std::string path = (folder / "store").string();
            StoreIndex index = index_of_two_views();
            {
                const auto first = need(StoreWriter::open(path, index, false));
                if (complete) {
                    ASSERT_OK(first->finish());
                }
            }
            index.source = "y";
            fault::arm("tables.remove", hit);
            const Status status = StoreWriter::open(path, index, true).status();
            removed = fault::disarm();
            if (removed < hit) {
                EXPECT_OK(status);
                break;
            }
            EXPECT_ERROR(status, Code::kIo, "cannot remove");
            index.source = "z";
            EXPECT_FALSE(need(StoreWriter::open(path, index, true))->is_begun());
        }
        EXPECT_GE(removed, 4U) << "arrays and their checksums";
    }
}

TEST(Resume, ChangedFilesAreNoticed) {
    const SampleFolder folder;
    const fs::path source = folder / "srn";
    write_all(sample_cars(source));
    const auto both = [&] {
        const Status store = convert(source, "train", Layout::kStore, folder / "store");
        const Status srn = convert(source, "train", Layout::kSrn, folder / "out");
        return std::pair(store, srn);
    };
    for (int i = 0; i < 2; ++i) {
        const auto [store, srn] = both();
        ASSERT_OK(store);
        ASSERT_OK(srn);
    }
    fs::path mask;
    for (const auto& entry : fs::recursive_directory_iterator(source / "srn_cars/cars_train"))
        if (entry.path().parent_path().filename() == "mask") mask = entry.path();
    fs::last_write_time(mask, fs::last_write_time(mask) + std::chrono::seconds(1));
    const auto [store, srn] = both();
    EXPECT_ERROR(store, Code::kInvalidArgument, "or one of files that have changed since");
    EXPECT_ERROR(srn, Code::kInvalidArgument, "holds another export of the split train");
}

TEST(Resume, StoreOfAnotherSplitIsRefused) {
    const CarsFolder folder;
    const fs::path store = folder / "store";
    ASSERT_OK(convert(folder / "srn", "train", Layout::kStore, store));
    bool lacks = false;
    data::DatasetDesc desc;
    desc.path = (store / "train").string();
    EXPECT_OK(data::Dataset::open(desc));
    desc.split = "test";
    desc.lacks_split = &lacks;
    EXPECT_ERROR(data::Dataset::open(desc), Code::kNotFound,
                 "is a store of the split train, not of test: ask for the split train, or name");
    EXPECT_TRUE(lacks);
}

TEST(Resume, StoreWithADamagedRecordIsRefused) {
    const CarsFolder folder;
    ASSERT_OK(convert(folder / "srn", "val", Layout::kStore, folder / "store"));
    const fs::path file = folder / "store/val/rgb.npy";
    std::string bytes = file_text(file);
    bytes.back() = static_cast<char>(bytes.back() ^ 1);
    std::ofstream(file, std::ios::binary) << bytes;
    EXPECT_ERROR(convert(folder / "store", "val", Layout::kSrn, folder / "back"), Code::kFormat,
                 "rgb.npy': record 3 does not have its checksum");
    std::ofstream(file, std::ios::binary) << bytes.substr(0, bytes.size() - 1);
    EXPECT_ERROR(convert(folder / "store", "val", Layout::kSrn, folder / "back2"), Code::kFormat,
                 "it is truncated or damaged");
    put_text(folder / "store/val/store.json", "{\"format\": \"libsplat store\"");
    EXPECT_ERROR(convert(folder / "store", "val", Layout::kSrn, folder / "back3"), Code::kFormat,
                 "remove the store and import again");
}

}  // namespace
}  // namespace splat::tables
