#include "tables/table_writer.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "core/fault.h"
#include "core/os/file.h"
#include "core/os/path.h"
#include "io/file.h"
#include "io/folder.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kGroupRows = 512;
constexpr std::uint64_t kMaxGroupBytes = std::uint64_t{32} << 20;

/// Waits until the disk has the file.
Status flush_file(const std::string& path) {
    const os::Handle file = os::open(path, os::Open::kUpdateOld);
    if (file == os::kNoHandle) return io::system_error(errno, "open", path);
    Status status;
    while (status.ok() &&
           (SPLAT_FAULT("tables.flush") ? (errno = ENOSPC, -1) : os::flush(file)) != 0)
        if (errno != EINTR) status = io::system_error(errno, "flush", path);
    os::close(file);
    return status;
}

}  // namespace

std::size_t row_group(std::uint64_t row_bytes) {
    return std::clamp<std::uint64_t>(kMaxGroupBytes / std::max<std::uint64_t>(row_bytes, 1), 1,
                                     kGroupRows);
}

std::vector<WrittenColumn> columns_of(Table table) {
    using Type = WrittenColumn::Type;
    const TableKind kind = kind_of(table);
    std::vector<WrittenColumn> columns = {{"uuid", Type::kText}};
    if (table != Table::kIntrinsics)
        columns.push_back({"frame_id", table == Table::kNormal ? Type::kText : Type::kInteger});
    columns.push_back({kind.column, kind.map == nullptr ? Type::kText : Type::kBlob});
    return columns;
}

Status write_table_file(Session& session, const std::string& path, Table table, const NextRow& next,
                        std::size_t group) {
    const fs::path target = os::path_of(path);
    const std::string temporary =
        os::text_of(target.parent_path() / ("." + os::text_of(target.filename()) + ".tmp"));
    SPLAT_TRY(io::make_folders(target.parent_path()));
    Status status = session.write_parquet(temporary, columns_of(table), next, group);
    if (!status.ok() && status.code() == Code::kIo)
        status = Status(Code::kIo, "cannot write '" + path + "': " + status.message());
    if (status.ok()) status = flush_file(temporary);
    if (status.ok() && os::rename(temporary, path) != 0)
        status = io::system_error(errno, "rename", path);
    if (!status.ok()) os::remove(temporary);
    return status;
}

std::string table_card(const std::string& category, const std::vector<Table>& tables,
                       const std::vector<std::string>& splits, std::uint32_t resolution) {
    std::string text = "---\nconfigs:\n";
    for (const Table table : tables) {
        const char* const name = kind_of(table).name;
        text += format("- config_name: srn_%s_%s\n  data_files:\n", category.c_str(), name);
        for (const std::string& split : splits)
            text += format("  - split: %s\n    path: \"%s/%s/*.parquet\"\n", split.c_str(), name,
                           split.c_str());
    }
    text += format("---\n\n# srn_%s with priors\n\n", category.c_str());
    text += "Rows of different tables belong together by `uuid` and `frame_id`.\n\n";
    text += "| table | column | holds |\n|---|---|---|\n";
    for (const Table table : tables) {
        const TableKind kind = kind_of(table);
        std::string holds = table == Table::kPoses ? "text of pose/*.txt, camera-to-world"
                                                   : "text of intrinsics.txt";
        if (kind.map != nullptr && kind.channels == 3)
            holds = format("uint8 [3,%u,%u]", resolution, resolution);
        else if (kind.map != nullptr)
            holds = format("uint8 [%u,%u]", resolution, resolution);
        text += format("| %s | `%s` | %s |\n", kind.name, kind.column, holds.c_str());
    }
    return text;
}

}  // namespace splat::tables
