#include <algorithm>
#include <filesystem>

#include "core/log.h"
#include "core/os/path.h"
#include "data/export_rows.h"
#include "data/folder.h"
#include "io/file.h"
#include "io/folder.h"
#include "tables/table_writer.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using tables::Table;

/// Row groups of a file of images: what a killed export loses at most. Text has one file.
constexpr std::uint64_t kFileGroups = 16;

/// One table on its way to files: a cursor over the objects and views.
class TableRows {
  public:
    TableRows(ExportRows& rows, Table table) : rows_(rows), table_(table) {}

    [[nodiscard]] std::uint64_t rows() const {
        return table_ == Table::kIntrinsics ? rows_.objects().size() : rows_.rows();
    }

    /// Go on after `count` rows.
    void skip(std::uint64_t count) {
        for (; count > 0; --count) step();
    }

    Status next(std::vector<tables::Cell>& cells) {
        const std::uint32_t object = rows_.objects()[object_];
        if (cameras_of_ != static_cast<std::int64_t>(object)) {
            SPLAT_ASSIGN(cameras_, rows_.cameras(object));
            cameras_of_ = object;
        }
        cells[0] = std::string_view(rows_.name(object));
        if (table_ == Table::kIntrinsics) {
            cells[1] = std::string_view(cameras_.text.intrinsics);
        } else {
            const std::int64_t frame = cameras_.frames[view_];
            frame_ = format("%06lld", lld(frame));
            if (table_ == Table::kNormal)
                cells[1] = std::string_view(frame_);
            else
                cells[1] = frame;
            if (table_ == Table::kPoses) {
                cells[2] = std::string_view(cameras_.text.views[view_].pose);
            } else {
                SPLAT_ASSIGN(planes_, rows_.planes(object, view_, table_));
                cells[2] = io::as_text(planes_);
            }
            SPLAT_TRY(rows_.advance(1));
        }
        step();
        return {};
    }

  private:
    void step() {
        ++view_;
        if (table_ != Table::kIntrinsics &&
            view_ < rows_.dataset().index().views_of[rows_.objects()[object_]])
            return;
        view_ = 0;
        ++object_;
    }

    ExportRows& rows_;
    Table table_;
    std::size_t object_ = 0;
    std::uint32_t view_ = 0;
    ExportRows::Cameras cameras_;
    std::int64_t cameras_of_ = -1;
    std::string frame_;
    io::Buffer planes_;
};

/// Path in the folder of file `i` of `count`.
std::string file_path(Table table, const std::string& split, std::uint64_t i, std::uint64_t count) {
    const char* const name = tables::kind_of(table).name;
    const std::string folder = std::string(name) + "/" + split + "/" + name;
    if (count == 1) return folder + ".parquet";
    return folder + format("-%05llu-of-%05llu.parquet", llu(i), llu(count));
}

Status export_table(ExportRows& rows, const ExportDesc& desc, Table table, tables::Session& session,
                    tables::Journal& journal) {
    TableRows source(rows, table);
    const bool images = tables::kind_of(table).map != nullptr;
    const std::uint64_t side = rows.dataset().resolution();
    const std::size_t group = tables::row_group(tables::kind_of(table).channels * side * side);
    const std::uint64_t each =
        images ? kFileGroups * group : std::max<std::uint64_t>(source.rows(), 1);
    const std::uint64_t count = (source.rows() + each - 1) / each;
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint64_t size = std::min(each, source.rows() - i * each);
        const std::string path = file_path(table, desc.split, i, count);
        if (journal.holds(path)) {
            source.skip(size);
            if (table != Table::kIntrinsics) SPLAT_TRY(rows.advance(size));
            continue;
        }
        std::uint64_t left = size;
        const auto next = [&](std::vector<tables::Cell>& cells) -> Result<bool> {
            if (left == 0) return false;
            --left;
            SPLAT_TRY(source.next(cells));
            return true;
        };
        SPLAT_TRY(tables::write_table_file(session, desc.path + "/" + path, table, next, group));
        SPLAT_TRY(journal.add(path));
    }
    return {};
}

/// Splits whose folder of poses is there, in the order of kSplits.
Result<std::vector<std::string>> splits_there(const std::string& folder) {
    std::vector<std::string> splits;
    for (const char* split : tables::kSplits) {
        SPLAT_ASSIGN(const bool is_there, io::has_file(folder + format("/export_%s.json", split)));
        if (is_there) splits.emplace_back(split);
    }
    return splits;
}

/// Write README.md, unless someone else's is there.
Status write_card(ExportRows& rows, const ExportDesc& desc, const std::vector<Table>& all) {
    const std::string path = desc.path + "/README.md";
    const auto found = io::read_file(path, 1U << 20);
    if (found.ok() &&
        !io::as_text(found.value()).starts_with("---\nconfigs:\n- config_name: srn_")) {
        log(LogLevel::kWarning, format("'%s' is kept; it is not of an export", path.c_str()));
        return {};
    }
    SPLAT_ASSIGN(const std::vector<std::string> splits, splits_there(desc.path));
    const std::string card =
        tables::table_card(desc.category, all, splits, rows.dataset().resolution());
    return io::write_file(path, io::as_bytes(card));
}

}  // namespace

Status export_tables(ExportRows& rows, const ExportDesc& desc) {
    SPLAT_TRY(io::make_folders(os::path_of(desc.path)));
    std::error_code failed;
    const std::string root = os::text_of(fs::canonical(os::path_of(desc.path), failed));
    SPLAT_ASSIGN(const auto session, tables::Session::open(desc.library, {desc.path, root}));
    std::vector<Table> all = {Table::kIntrinsics, Table::kPoses};
    for (const Table map : rows.maps()) all.push_back(map);
    std::vector<std::string> targets;
    for (const Table table : all)
        targets.push_back(desc.path + "/" + tables::kind_of(table).name + "/" + desc.split);
    SPLAT_ASSIGN(std::string source, rows.source(desc.path));
    SPLAT_ASSIGN(tables::Journal journal,
                 tables::Journal::of_export(desc.path, desc.split, std::move(source), targets));
    for (const Table table : all) SPLAT_TRY(export_table(rows, desc, table, *session, journal));
    return write_card(rows, desc, all);
}

}  // namespace splat::data
