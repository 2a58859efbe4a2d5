#include "tables/published_tables.h"

#include "support/expect_status.h"
#include "tables/table_samples.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

/// Rows of a table of images, of `bytes` bytes from the character `first` on.
std::string image_select(const std::string& column, int first, int bytes,
                         const std::string& frame) {
    return "SELECT chr(97 + CAST(i // 3 AS INTEGER)) AS uuid, " + frame +
           " AS frame_id, CAST(repeat(chr(" + std::to_string(first) + " + CAST(i AS INTEGER)), " +
           std::to_string(bytes) + ") AS BLOB) AS " + column +
           " FROM range(6) t(i) ORDER BY i DESC";
}

}  // namespace

std::string png_literal(const io::Image& image) {
    std::string text = "'";
    for (const std::byte byte : need(io::write_png(image)))
        text += format("\\x%02X", static_cast<unsigned>(byte));
    return text + "'::BLOB";
}

PublishedTables::PublishedTables() {
    selects["intrins"] =
        "SELECT * FROM (VALUES ('b', E'8 2 2 0\\n0 0 0\\n1\\n4 4\\n'), ('a', E'4 2 2 0\\n0 0 "
        "0\\n1\\n4 4\\n')) t(uuid, intrinsics)";
    selects["poses"] =
        "SELECT chr(97 + CAST(i // 3 AS INTEGER)) AS uuid, i % 3 AS frame_id, '1 0 0 0 0 1 0 0 0 0 "
        "1 -' || CAST(i + 1 AS VARCHAR) || ' 0 0 0 1' AS pose FROM range(6) t(i) ORDER BY i DESC";
    selects["rgbs"] = image_select("rgb", 'a', 48, "i % 3");
    selects["depths"] = image_select("depth", 'A', 16, "i % 3");
    selects["normals"] = image_select("normal", '0', 48, "printf('%06d', i % 3)");
}

Status PublishedTables::write(const fs::path& folder, const std::string& options) const {
    std::vector<std::string> statements;
    for (const auto& [table, select] : selects) {
        const fs::path file = folder / table / "train" / (table + ".parquet");
        fs::create_directories(file.parent_path());
        statements.push_back("COPY (" + select + ") TO " + tables::sql_literal(file.string()) +
                             " (FORMAT parquet" + options + ")");
    }
    return run_sql(folder, statements);
}

Status PublishedTables::write_with_split(const fs::path& folder) const {
    std::vector<std::string> statements;
    for (const auto& [table, select] : selects)
        statements.push_back(
            "COPY (SELECT *, 'test' AS split FROM (" + select +
            ") WHERE uuid = 'a' UNION ALL SELECT *, 'train' FROM (" + select + ")) TO " +
            tables::sql_literal((folder / ("srn_cars_" + table + ".parquet")).string()) +
            " (FORMAT parquet)");
    return run_sql(folder, statements);
}

}  // namespace splat::test
