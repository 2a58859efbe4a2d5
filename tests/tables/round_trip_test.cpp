// Tables, SRN's folders and stores hold the same, whatever way the data goes.
#include <gtest/gtest.h>

#include <iterator>
#include <sstream>

#include "data/dataset_check.h"
#include "support/expect_status.h"
#include "support/log_capture.h"
#include "synthetic/sample_folder.h"
#include "tables/journal.h"
#include "tables/table_samples.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;
using data::Layout;
using namespace test;

/// Hashes of cameras and images of every object of a split.
std::vector<std::uint64_t> hashes_of(const fs::path& path, const std::string& split) {
    data::DatasetDesc desc;
    desc.path = path.string();
    desc.split = split;
    const auto dataset = data::Dataset::open(desc);
    EXPECT_OK(dataset);
    std::vector<std::uint64_t> hashes;
    if (!dataset.ok()) return hashes;
    for (std::uint32_t i = 0; i < dataset.value()->index().names.size(); ++i) {
        const auto check = need(data::check_object(*dataset.value(), i));
        EXPECT_TRUE(check.problems.empty());
        hashes.push_back(check.hash);
    }
    return hashes;
}

TEST(RoundTrip, ParquetTablesGiveTheFilesOfSrnBack) {
    SPLAT_NEED_DUCKDB();
    const CarsFolder folder;
    for (const char* split : {"train", "val", "test"}) {
        ASSERT_OK(convert(folder / "srn", split, Layout::kTables, folder / "tables"));
        ASSERT_OK(convert(folder / "tables", split, Layout::kSrn, folder / "back"));
        EXPECT_EQ(hashes_of(folder / "srn", split), hashes_of(folder / "tables", split));
    }
    const std::string before = tree_of(folder / "srn", {".png", ".txt"});
    EXPECT_GT(before.size(), 10000U);
    EXPECT_TRUE(before == tree_of(folder / "back", {".png", ".txt"}));
}

TEST(RoundTrip, StoreGivesTheFilesOfSrnBack) {
    const CarsFolder folder;
    for (const char* split : {"train", "val", "test"}) {
        ASSERT_OK(convert(folder / "srn", split, Layout::kStore, folder / "store"));
        ASSERT_OK(convert(folder / "store", split, Layout::kSrn, folder / "back"));
        EXPECT_EQ(hashes_of(folder / "srn", split), hashes_of(folder / "store", split));
    }
    EXPECT_TRUE(tree_of(folder / "srn", {".png", ".txt"}) ==
                tree_of(folder / "back", {".png", ".txt"}));
}

TEST(RoundTrip, TablesHaveThePublishedParquetSchema) {
    SPLAT_NEED_DUCKDB();
    const CarsFolder folder;
    const fs::path out = folder / "tables";
    ASSERT_OK(convert(folder / "srn", "train", Layout::kTables, out));
    const std::pair<const char*, const char*> rows[] = {
        {"intrins", "uuid VARCHAR, intrinsics VARCHAR"},
        {"poses", "uuid VARCHAR, frame_id BIGINT, pose VARCHAR"},
        {"rgbs", "uuid VARCHAR, frame_id BIGINT, rgb BLOB"},
        {"depths", "uuid VARCHAR, frame_id BIGINT, depth BLOB"},
        {"normals", "uuid VARCHAR, frame_id VARCHAR, normal BLOB"},
        {"segmentation", "uuid VARCHAR, frame_id BIGINT, segmentation BLOB"}};
    for (const auto& [table, columns] : rows) {
        const std::string file =
            (out / table / "train" / (std::string(table) + ".parquet")).string();
        const auto found = need(ask_sql(
            out,
            "SELECT string_agg(column_name || ' ' || column_type, ', ') FROM (DESCRIBE SELECT "
            "* FROM read_parquet(" +
                sql_literal(file) + "))"));
        EXPECT_EQ(found, columns);
        const auto codec = need(
            ask_sql(out, "SELECT string_agg(DISTINCT compression, ',') FROM parquet_metadata(" +
                             sql_literal(file) + ")"));
        EXPECT_EQ(codec, "SNAPPY");
    }
    const std::string card = file_text(out / "README.md");
    EXPECT_HAS(card,
               "- config_name: srn_cars_rgbs\n  data_files:\n  - split: train\n    path: "
               "\"rgbs/train/*.parquet\"\n");
}

TEST(RoundTrip, ViewsWithoutNumbersAreCounted) {
    const CarsFolder folder;
    const fs::path object = folder / "srn/srn_cars/cars_val/000000_car";
    for (const char* kind : {"pose", "rgb", "depth", "normal", "mask"}) {
        const std::string end = std::string(kind) == "pose" ? ".txt" : ".png";
        fs::rename(object / kind / ("000000" + end), object / kind / ("front" + end));
    }
    const std::vector<std::uint64_t> before = hashes_of(folder / "srn", "val");
    const LogCapture log;
    ASSERT_OK(convert(folder / "srn", "val", Layout::kSrn, folder / "out"));
    EXPECT_HAS(log.text(), "object '000000_car': names of views such as '000001'");
    EXPECT_TRUE(fs::exists(folder / "out/srn_cars/cars_val/000000_car/rgb/000003.png"));
    EXPECT_EQ(before, hashes_of(folder / "out", "val"));
}

/// A photograph of each colour with cameras, in NeRF's layout.
void put_photographs(const fs::path& folder, double second_focal) {
    std::string frames;
    for (int i = 0; i < 3; ++i) {
        put_image(folder / ("photo" + std::to_string(i) + ".png"), 16, 3,
                  static_cast<std::uint32_t>(i));
        frames += format(
            "%s{\"file_path\": \"photo%d.png\", \"fl_x\": %g, \"fl_y\": %g, "
            "\"cx\": 8, \"cy\": 8, \"w\": 16, \"h\": 16, \"transform_matrix\": "
            "[[1,0,0,0.25],[0,1,0,0],[0,0,1,%d],[0,0,0,1]]}",
            i == 0 ? "" : ", ", i, i == 1 ? second_focal : 20.0, i == 1 ? second_focal : 20.0,
            i + 2);
    }
    put_text(folder / "transforms.json", "{\"frames\": [" + frames + "]}");
}

TEST(RoundTrip, ParquetTablesOfPhotographs) {
    SPLAT_NEED_DUCKDB();
    const SampleFolder folder;
    put_photographs(folder / "photos", 20);
    const std::vector<std::uint64_t> before = hashes_of(folder / "photos", "train");
    ASSERT_OK(convert(folder / "photos", "train", Layout::kTables, folder / "tables"));
    EXPECT_EQ(before, hashes_of(folder / "tables", "train"));
    put_photographs(folder / "zoomed", 21);
    EXPECT_ERROR(convert(folder / "zoomed", "train", Layout::kTables, folder / "other"),
                 Code::kUnsupported, "focal lengths 20 and 20, view 1 has 21");
}

TEST(RoundTrip, FoldersOfImagesGiveTheImagesAndCamerasBack) {
    const CarsFolder folder;
    const fs::path images = folder / "images", back = folder / "back";
    for (const char* split : {"train", "val", "test"}) {
        ASSERT_OK(convert(folder / "srn", split, Layout::kImages, images));
        ASSERT_OK(convert(images, split, Layout::kSrn, back));
        for (const std::uint64_t hash : hashes_of(images, split)) EXPECT_NE(hash, 0U);
    }
    EXPECT_TRUE(tree_of(back, {".png"}) == tree_of(folder / "srn", {".png"}));
    // Cameras have all their digits, but go through other axes and an inverse.
    const auto numbers_of = [](const fs::path& file) {
        std::istringstream text(file_text(file));
        return std::vector<double>(std::istream_iterator<double>(text), {});
    };
    for (const char* file :
         {"cars_train/000000_car/pose/000002.txt", "cars_test/000000_car/pose/000003.txt",
          "cars_val/000000_car/intrinsics.txt"}) {
        const std::vector<double> before = numbers_of(folder / "srn/srn_cars" / file),
                                  after = numbers_of(back / "srn_cars" / file);
        ASSERT_EQ(before.size(), after.size()) << file;
        ASSERT_FALSE(before.empty()) << file;
        for (std::size_t i = 0; i < before.size(); ++i) EXPECT_NEAR(before[i], after[i], 1e-6);
    }
    fs::remove_all(images / "val");
    EXPECT_ERROR(convert(images, "val", Layout::kSrn, folder / "other"), Code::kNotFound,
                 "holds neither transforms.json");
    put_photographs(folder / "zoomed", 21);
    EXPECT_OK(convert(folder / "zoomed", "train", Layout::kImages, folder / "z"))
        << "each image keeps its focal length";
}

TEST(RoundTrip, ExportRefusesFoldersOfOthers) {
    const CarsFolder folder;
    EXPECT_ERROR(convert(folder / "srn", "train", Layout::kSrn, folder / "srn"),
                 Code::kInvalidArgument, "srn/srn_cars/cars_train' is there and is no export");
}

TEST(RoundTrip, ExportRefusesAnotherExportsFolder) {
    const CarsFolder folder;
    ASSERT_OK(convert(folder / "srn", "train", Layout::kSrn, folder / "out"));
    ASSERT_OK(convert(folder / "srn", "train", Layout::kSrn, folder / "out"));
    auto desc = sample_cars(folder / "other");
    desc.train_views = 2;
    write_all(desc);
    EXPECT_ERROR(convert(folder / "other", "train", Layout::kSrn, folder / "out"),
                 Code::kInvalidArgument, "holds another export of the split train");
}

TEST(RoundTrip, ListOfAnExportWithoutItsNumbersIsDamaged) {
    const SampleFolder folder;
    put_text(folder / "a", "");
    const auto verified = [&](const std::string& bytes, const std::string& crc,
                              const std::string& path = "a") {
        put_text(folder / "export_train.json", R"({"source": "s", "files": [{"path": ")" + path +
                                                   R"(", "bytes": )" + bytes +
                                                   ", \"crc32\": " + crc + "}]}");
        return Journal::verify(folder.path().string(), "train");
    };
    EXPECT_OK(verified("0", "0"));
    for (const char* number : {"-1", "0.5", "1e300", "null"}) {
        EXPECT_ERROR(verified(number, "0"), Code::kFormat, "export_train.json' is damaged");
        EXPECT_ERROR(verified("0", number), Code::kFormat, "export_train.json' is damaged");
    }
    EXPECT_ERROR(verified("0", "4294967296"), Code::kFormat, "export_train.json' is damaged");
    for (const char* path : {"../a", "/a", R"(b\\a)", "C:a"})
        EXPECT_ERROR(verified("0", "0", path), Code::kFormat, "export_train.json' is damaged");
}

}  // namespace
}  // namespace splat::tables
