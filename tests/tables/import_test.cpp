#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "support/expect_status.h"
#include "support/log_capture.h"
#include "support/system.h"
#include "synthetic/sample_folder.h"
#include "tables/import.h"
#include "tables/published_tables.h"
#include "tables/store.h"
#include "tables/table_files.h"
#include "tables/table_samples.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;
using namespace test;

Status import(const fs::path& folder, const std::string& split = "train") {
    return import_tables({folder.string(), split, (folder / ".splat" / split).string(), "", false},
                         nullptr);
}

/// The first byte of an image, if all of its bytes are equal.
int sample_of(const Store& store, Table map, std::uint64_t row) {
    std::vector<std::uint8_t> image(store.index().image_bytes(map));
    EXPECT_OK(store.image(map, row, std::as_writable_bytes(std::span(image))));
    for (const std::uint8_t sample : image)
        if (sample != image[0]) return -1;
    return image[0];
}

/// The store holds what PublishedTables describes.
void expect_published(const fs::path& folder) {
    const auto opened = need(Store::open(folder.string()));
    const Store& store = *opened;
    EXPECT_EQ(store.index().resolution, 4U);
    ASSERT_EQ(store.index().objects.size(), 2U);
    EXPECT_EQ(store.index().objects[0].name, "a");
    EXPECT_EQ(need(store.intrinsics(0)), "4 2 2 0\n0 0 0\n1\n4 4\n");
    EXPECT_EQ(store.index().frames, (std::vector<std::int64_t>{0, 1, 2, 0, 1, 2}));
    for (std::uint64_t row = 0; row < 6; ++row) {
        const auto pose = need(store.pose(row));
        EXPECT_EQ(pose, "1 0 0 0 0 1 0 0 0 0 1 -" + std::to_string(row + 1) + " 0 0 0 1");
        const int number = static_cast<int>(row);
        EXPECT_EQ(sample_of(store, Table::kRgb, row), 'a' + number);
        EXPECT_EQ(sample_of(store, Table::kDepth, row), 'A' + number);
        EXPECT_EQ(sample_of(store, Table::kNormal, row), '0' + number);
    }
}

TEST(Import, ParquetRowsJoinByTheirIds) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    ASSERT_OK(PublishedTables().write(folder.path()));
    ASSERT_OK(import(folder.path()));
    expect_published(folder / ".splat/train");
}

TEST(Import, ParquetFilesOfAllSplitsAreReadByTheirColumn) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    ASSERT_OK(PublishedTables().write_with_split(folder.path()));
    ASSERT_OK(import(folder.path()));
    expect_published(folder / ".splat/train");
    ASSERT_OK(import(folder.path(), "test"));
    EXPECT_EQ(need(Store::open((folder / ".splat/test").string()))->index().frames.size(), 3U);
    EXPECT_ERROR(import(folder.path(), "val"), Code::kNotFound, "no rows of this split");
}

TEST(Import, ParquetFilesLieInFoldersOfAnyName) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    const fs::path odd = folder / test::kOddName / "split=test";
    fs::create_directories(odd);
    ASSERT_OK(PublishedTables().write_with_split(odd));
    ASSERT_OK(import(odd));
    expect_published(odd / ".splat/train");
}

TEST(Import, ParquetFilesMayBeMany) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    PublishedTables tables;
    for (const char* part : {"0000", "0001"}) {
        const bool first = std::string(part) == "0000";
        PublishedTables half;
        for (auto& [name, select] : half.selects)
            select = "SELECT * FROM (" + select + ") WHERE uuid = '" + (first ? "b" : "a") + "'";
        ASSERT_OK(half.write(folder.path()));
        for (const auto& [name, select] : half.selects) {
            const fs::path in = folder / name / "train";
            const fs::path out = folder / "set" / ("srn_cars_" + name) / "train";
            fs::create_directories(out);
            fs::rename(in / (name + ".parquet"), out / (std::string(part) + ".parquet"));
        }
    }
    ASSERT_OK(import(folder / "set"));
    expect_published(folder / "set/.splat/train");
}

TEST(Import, ParquetColumnOfAnotherNameGivesAWarning) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    PublishedTables tables;
    tables.selects["rgbs"] =
        "SELECT uuid, frame_id, rgb AS depth FROM (" + tables.selects["rgbs"] + ")";
    ASSERT_OK(tables.write(folder.path()));
    const LogCapture log;
    ASSERT_OK(import(folder.path()));
    EXPECT_HAS(log.text(), "table rgbs");
    EXPECT_HAS(log.text(), "column 'depth', the only binary one, is taken as rgb");
    expect_published(folder / ".splat/train");
}

/// An SQL blob of an image of 4 x 4 pixels of one sample.
std::string png_literal(std::uint16_t sample, std::uint32_t channels) {
    return test::png_literal(
        {4, 4, channels, 8, std::vector<std::uint16_t>(std::size_t{16} * channels, sample)});
}

TEST(Import, ParquetImagesMayBeEncodedFiles) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    PublishedTables tables;
    std::string rgb = "SELECT uuid, frame_id, {'bytes': CASE";
    std::string depth = rgb;
    for (std::uint16_t i = 0; i < 6; ++i) {
        const auto place = format(" WHEN uuid = '%c' AND frame_id = %d THEN ", 'a' + i / 3, i % 3);
        rgb += place + png_literal(static_cast<std::uint16_t>('a' + i), 4);
        depth += place + png_literal(static_cast<std::uint16_t>('A' + i), 1);
    }
    tables.selects["rgbs"] =
        rgb + " END, 'path': 'x.png'} AS rgb FROM (" + tables.selects["rgbs"] + ")";
    tables.selects["depths"] =
        depth + " END, 'path': NULL} AS depth FROM (" + tables.selects["depths"] + ")";
    ASSERT_OK(tables.write(folder.path()));
    ASSERT_OK(import(folder.path()));
    expect_published(folder / ".splat/train");
}

struct BadTable {
    const char* table;
    const char* select;  ///< select on the rows t of the good table
    const char* message;
};

TEST(Import, ParquetTablesWithErrorsAreRefused) {
    SPLAT_NEED_DUCKDB();
    const BadTable rows[] = {
        {"rgbs", "SELECT uuid, rgb FROM t", "there is no column frame_id; columns: uuid, rgb"},
        {"rgbs", "SELECT uuid, frame_id, rgb AS x, rgb AS y FROM t", "there is no column rgb"},
        {"rgbs", "SELECT uuid, frame_id, 1 AS rgb FROM t", "column rgb holds values of another"},
        {"rgbs", "SELECT uuid, frame_id, [{'bytes': rgb}] AS rgb FROM t",
         "column rgb holds values of another"},
        {"rgbs", "SELECT uuid, frame_id, {'a': 1, 'b': {'c': 1, 'bytes': rgb}} AS rgb FROM t",
         "column rgb holds values of another"},
        {"poses", "SELECT uuid, frame_id, 1 AS pose FROM t", "column pose holds values of"},
        {"poses", "SELECT 1 AS uuid, frame_id, pose FROM t", "column uuid holds values of"},
        {"depths", "SELECT * FROM t LIMIT 5",
         "table depths: 5 rows, but poses has 6; the first missing: uuid 'a', frame 0"},
        {"rgbs", "SELECT * FROM t UNION ALL (SELECT * FROM t LIMIT 1)",
         "uuid 'b', frame 2 occurs twice"},
        {"poses", "SELECT * FROM t UNION ALL SELECT * FROM t WHERE frame_id = 1 AND uuid = 'a'",
         "table poses: uuid 'a', frame 1 occurs twice"},
        {"intrins", "SELECT * FROM t UNION ALL SELECT * FROM t", "occurs twice"},
        {"normals", "SELECT 'c' AS uuid, frame_id, normal FROM t",
         "table normals, column normal, row 0 of '"},
        {"normals", "SELECT uuid, frame_id || '7' AS frame_id, normal FROM t",
         "uuid 'b', frame 27 is not in the table poses"},
        {"normals", "SELECT uuid, frame_id || 'x' AS frame_id, normal FROM t",
         "column frame_id, row 0 of '"},
        {"poses", "SELECT uuid, -1 - frame_id AS frame_id, pose FROM t", "'-3' is no number from"},
        {"poses", "SELECT uuid, NULL::BIGINT AS frame_id, pose FROM t", "the value is missing"},
        {"rgbs", "SELECT NULL::VARCHAR AS uuid, frame_id, rgb FROM t", "column uuid, row 0"},
        {"rgbs",
         "SELECT uuid, frame_id, CASE WHEN frame_id = 0 THEN NULL ELSE rgb END AS rgb FROM t",
         "table rgbs, column rgb, row 2 of '"},
        {"rgbs",
         "SELECT uuid, frame_id, CASE WHEN frame_id = 0 THEN 'ab'::BLOB ELSE rgb END AS rgb FROM t",
         "2 bytes, expected 48: uint8 [3,4,4]"},
        {"rgbs", "SELECT uuid, frame_id, 'abcd'::BLOB AS rgb FROM t",
         "4 bytes, expected 3 S S of a square image"},
        {"depths", "SELECT uuid, frame_id, 'abcd'::BLOB AS depth FROM t",
         "4 bytes, expected 16: uint8 [1,4,4]"},
        {"rgbs", "SELECT uuid, frame_id, {'bytes': 'no image'::BLOB, 'path': ''} AS rgb FROM t",
         "table rgbs, column rgb, row 0"},
        {"rgbs", "SELECT uuid, frame_id, {'bytes': NULL::BLOB, 'path': 'x.png'} AS rgb FROM t",
         "the value is missing"},
        {"poses", "SELECT uuid, frame_id, replace(pose, ' 1', '') AS pose FROM t",
         "numbers, expected 16"},
        {"poses", "SELECT uuid, frame_id, replace(pose, '1 0', '2 0') AS pose FROM t",
         "table poses, column pose, row 0"},
        {"poses", "SELECT uuid, frame_id, pose || repeat(' ', 600) AS pose FROM t",
         "expected at most 512"},
        {"poses", "SELECT * FROM t WHERE uuid = 'a'",
         "table poses: uuid 'b' of the table intrins has no rows"},
        {"intrins", "SELECT * FROM t WHERE uuid = 'a'", "uuid 'b' is not in the table intrins"},
        {"intrins", "SELECT uuid, 'x' AS intrinsics FROM t", "no number at byte 0"},
        {"rgbs", "SELECT * FROM t WHERE uuid = 'c'", "table rgbs: 0 rows, but poses has 6"},
    };
    for (const BadTable& row : rows) {
        const SampleFolder folder;
        PublishedTables tables;
        tables.selects[row.table] = "WITH t AS (" + tables.selects[row.table] + ") " + row.select;
        ASSERT_OK(tables.write(folder.path())) << row.select;
        EXPECT_ERROR(import(folder.path()), Code::kFormat, row.message) << row.select;
        EXPECT_FALSE(is_store((folder / ".splat/train").string()).value());
    }
}

TEST(Import, ParquetFilesThatAreDamagedAreRefused) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    ASSERT_OK(PublishedTables().write(folder.path()));
    const fs::path file = folder / "rgbs/train/rgbs.parquet";
    const std::string whole = file_text(file);
    const auto damaged = [&](const std::string& bytes) {
        std::ofstream(file, std::ios::binary) << bytes;
        return import(folder.path());
    };
    EXPECT_ERROR(damaged(""), Code::kFormat, "table rgbs, '");
    EXPECT_ERROR(damaged("not a table"), Code::kFormat, "rgbs.parquet");
    EXPECT_ERROR(damaged(whole.substr(0, whole.size() - 9)), Code::kFormat, "rgbs.parquet");
    EXPECT_ERROR(damaged(whole.substr(0, 40) + whole.substr(60)), Code::kFormat, "rgbs.parquet");
    EXPECT_ERROR(damaged(whole.substr(0, whole.size() - 8) + "\xFF\xFF\xFF\x7FPAR1"), Code::kFormat,
                 "rgbs.parquet");
    ASSERT_OK(damaged(whole));
    expect_published(folder / ".splat/train");
}

TEST(Import, ParquetFooterThatLiesAboutItsRowsIsRefused) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    ASSERT_OK(PublishedTables().write(folder.path()));
    const fs::path file = folder / "depths/train/depths.parquet";
    const std::string whole = file_text(file);
    std::uint32_t footer = 0;
    std::memcpy(&footer, &whole[whole.size() - 8], sizeof footer);
    // An i64 of the next field but one is 0x16 in Thrift's compact protocol, 6 is 12 as zigzag: num_rows of
    // FileMetaData and of RowGroup, and num_values of columns, which nothing depends on.
    std::size_t refused = 0;
    for (std::size_t at = whole.size() - 8 - footer; at < whole.size() - 8; ++at) {
        if (whole[at] != 0x16 || whole[at + 1] != 12) continue;
        std::string lie = whole;
        lie[at + 1] = 14;
        std::ofstream(file, std::ios::binary) << lie;
        fs::remove_all(folder / ".splat");
        const Status status = import(folder.path());
        if (status.ok()) expect_published(folder / ".splat/train");
        if (status.code() == Code::kFormat) ++refused;
    }
    EXPECT_EQ(refused, 2U);
}

/// rgbs/train-00000-of-00001.parquet, as the datasets of Hugging Face lie.
TEST(Import, ReadsFilesNamedAfterTheirSplit) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    ASSERT_OK(PublishedTables().write(folder.path()));
    for (const char* table : {"intrins", "poses", "rgbs", "depths", "normals", "segmentation"}) {
        const fs::path below = folder / table;
        if (!fs::exists(below / "train")) continue;
        int files = 0;
        for (const auto& entry : fs::directory_iterator(below / "train"))
            fs::rename(entry.path(), below / format("train-%05d-of-00001.parquet", files++));
        fs::remove_all(below / "train");
    }
    EXPECT_TRUE(is_tables(folder.path().string()).value());
    ASSERT_OK(import(folder.path()));
    expect_published(folder / ".splat/train");
    EXPECT_ERROR(import(folder.path(), "val"), Code::kNotFound,
                 "no .parquet file of the split val");
}

TEST(Import, ColumnsOfOtherTypesAreRefusedWithARemedy) {
    SPLAT_NEED_DUCKDB();
    const struct {
        const char *table, *value, *part;
    } others[] = {{"rgbs", "CAST(frame_id AS DOUBLE) AS frame_id",
                   "than integers or text: write it so, in pandas by df['frame_id'] = "
                   "df['frame_id'].astype('int64')"},
                  {"rgbs", "[1::UTINYINT, 2::UTINYINT] AS rgb",
                   "df['rgb'] = [numpy.uint8(numbers).tobytes() for numbers in df['rgb']]"},
                  {"poses", "encode(pose) AS pose", "df['pose'] = df['pose'].str.decode('utf-8')"}};
    for (const auto& other : others) {
        const SampleFolder folder;
        PublishedTables tables;
        std::string& select = tables.selects[other.table];
        select = "SELECT * REPLACE (" + std::string(other.value) + ") FROM (" + select + ")";
        ASSERT_OK(tables.write(folder.path()));
        EXPECT_ERROR(import(folder.path()), Code::kFormat, other.part);
    }
}

TEST(Import, FoldersWithoutTablesAreRefused) {
    const SampleFolder folder;
    EXPECT_ERROR(import(folder.path()), Code::kNotFound, "lacks tables: intrins, poses, rgbs");
    put_text(folder / "rgbs/train/a.parquet", "");
    EXPECT_ERROR(import(folder.path()), Code::kNotFound, "lacks tables: intrins, poses");
    put_text(folder / "intrins/test/a.parquet", "");
    put_text(folder / "poses/train/a.parquet", "");
    EXPECT_ERROR(import(folder.path(), "val"), Code::kNotFound,
                 "no .parquet file of the split val in the folders of intrins, poses, rgbs");
    EXPECT_ERROR(import(folder.path()), Code::kFormat,
                 "no .parquet file of the split train in the folders of intrins, but there are "
                 "some of poses");
    put_text(folder / "srn_chairs_rgbs/train/a.parquet", "");
    EXPECT_ERROR(import(folder.path()), Code::kInvalidArgument,
                 "two tables rgbs, 'rgbs' and 'srn_chairs_rgbs'");
}

TEST(Import, MissingLibrarySaysHowToGetIt) {
    const SampleFolder folder;
    for (const char* table : {"intrins", "poses", "rgbs"})
        put_text(folder / table / "train/a.parquet", "");
    const Status status = import_tables(
        {folder.path().string(), "train", (folder / "s").string(), "/nowhere/libduckdb.so", false},
        nullptr);
    EXPECT_ERROR(status, Code::kNotFound, "npm pack @duckdb/node-bindings-");
    EXPECT_ERROR(status, Code::kNotFound, "/nowhere/libduckdb.so");
    EXPECT_ERROR(import_tables({folder.path().string(), "train", (folder / "s").string(),
                                test::kSomeLibrary, false},
                               nullptr),
                 Code::kUnsupported, "has no function duckdb_");
}

}  // namespace
}  // namespace splat::tables
