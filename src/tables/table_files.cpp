#include "tables/table_files.h"

#include <filesystem>

#include "core/os/file.h"
#include "core/os/path.h"
#include "io/folder.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;

/// Names of the files that are tables; none where there is no such folder.
Result<std::vector<std::string>> parquet_files(const fs::path& folder) {
    const auto entries = io::entries_in(os::text_of(folder));
    std::vector<std::string> names;
    if (entries.status().code() == Code::kNotFound) return names;
    if (!entries.ok()) return entries.status();
    for (const io::FolderEntry& entry : entries.value())
        if (entry.name.ends_with(".parquet") && entry.kind != io::PathKind::kFolder)
            names.push_back(entry.name);
    return names;
}

/// "rgbs" and "srn_cars_rgbs" are names of the table rgbs.
bool names_table(const std::string& name, Table table) {
    const std::string own = kind_of(table).name;
    return name == own || name.ends_with("_" + own);
}

/// The name of a file without ".parquet" and "-00000-of-00002".
std::string stem_of(const std::string& file) {
    const std::string stem = file.substr(0, file.size() - std::string(".parquet").size());
    const std::size_t of = stem.rfind("-of-");
    const std::size_t dash = of == std::string::npos || of == 0 ? of : stem.rfind('-', of - 1);
    if (of == std::string::npos || dash == std::string::npos) return stem;
    const std::string number = stem.substr(dash + 1, of - dash - 1) + stem.substr(of + 4);
    return number.find_first_not_of("0123456789") == std::string::npos ? stem.substr(0, dash)
                                                                       : stem;
}

Status several(const std::string& folder, Table table, const std::string& a, const std::string& b) {
    return invalid("'%s' holds two tables %s, '%s' and '%s': keep each data set in its own folder",
                   folder.c_str(), kind_of(table).name, a.c_str(), b.c_str());
}

/// The folder of a table; empty if there is none.
Result<std::string> table_folder(const fs::path& folder, Table table) {
    std::string found;
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(os::text_of(folder)));
    for (const std::string& name : names) {
        if (!names_table(name, table)) continue;
        if (!found.empty()) return several(os::text_of(folder), table, found, name);
        found = name;
    }
    return found;
}

/// "train-00000-of-00001.parquet", as the datasets of Hugging Face call their files, and "validation".
bool is_of_split(const std::string& file, const std::string& split) {
    const std::string stem = stem_of(file);
    return stem == split || (split == "val" && stem == "validation");
}

/// Finds the files below a table's folder: those in its folder of the split, else those with the split's name.
Result<TableFiles> files_below(const fs::path& folder, Table table, const std::string& split) {
    TableFiles found{table, {}, false};
    SPLAT_ASSIGN(const std::vector<std::string> files, parquet_files(folder / split));
    for (const std::string& file : files) found.files.push_back(os::text_of(folder / split / file));
    if (!found.files.empty()) return found;
    SPLAT_ASSIGN(const std::vector<std::string> here, parquet_files(folder));
    for (const std::string& file : here)
        if (is_of_split(file, split)) found.files.push_back(os::text_of(folder / file));
    return found;
}

Result<TableFiles> files_in(const fs::path& folder, Table table) {
    TableFiles found{table, {}, true};
    std::string stem;
    SPLAT_ASSIGN(const std::vector<std::string> files, parquet_files(folder));
    for (const std::string& file : files) {
        const std::string own = stem_of(file);
        if (!names_table(own, table)) continue;
        if (!stem.empty() && own != stem) return several(os::text_of(folder), table, stem, own);
        stem = own;
        found.files.push_back(os::text_of(folder / file));
    }
    return found;
}

}  // namespace

Result<bool> is_tables(const std::string& folder) {
    SPLAT_ASSIGN(const std::vector<std::string> files, parquet_files(os::path_of(folder)));
    for (const std::string& file : files)
        if (names_table(stem_of(file), Table::kRgb)) return true;
    SPLAT_ASSIGN(std::vector<std::string> names, io::folders_in(folder));
    std::erase_if(names, [](const std::string& name) { return !names_table(name, Table::kRgb); });
    return io::holds_for_any(names, [&folder](const std::string& name) -> Result<bool> {
        for (const char* split : kSplits) {
            SPLAT_ASSIGN(const TableFiles found,
                         files_below(os::path_of(folder) / name, Table::kRgb, split));
            if (!found.files.empty()) return true;
        }
        return false;
    });
}

Result<std::vector<TableFiles>> find_tables(const std::string& folder, const std::string& split) {
    std::vector<TableFiles> tables;
    std::string missing;
    std::string without_split;
    for (const Table table : kTables) {
        const char* const name = kind_of(table).name;
        SPLAT_ASSIGN(const std::string below, table_folder(os::path_of(folder), table));
        TableFiles found;
        if (!below.empty()) {
            SPLAT_ASSIGN(found, files_below(os::path_of(folder) / below, table, split));
            if (found.files.empty())
                without_split += (without_split.empty() ? "" : ", ") + std::string(name);
        } else {
            SPLAT_ASSIGN(found, files_in(os::path_of(folder), table));
            if (found.files.empty() && kind_of(table).required)
                missing += (missing.empty() ? "" : ", ") + std::string(name);
        }
        if (!found.files.empty()) tables.push_back(std::move(found));
    }
    if (!missing.empty())
        return not_found(
            "'%s' lacks tables: %s; expected %s/%s/*.parquet, %s/%s-00000-of-00001.parquet or "
            "<name>_%s.parquet for each",
            folder.c_str(), missing.c_str(), kind_of(Table::kRgb).name, split.c_str(),
            kind_of(Table::kRgb).name, split.c_str(), kind_of(Table::kRgb).name);
    if (without_split.empty()) return tables;
    // All without the split: there is none. Some without it: the tables do not fit.
    return error(tables.empty() ? Code::kNotFound : Code::kFormat,
                 "'%s': no .parquet file of the split %s in the folders of %s%s%s", folder.c_str(),
                 split.c_str(), without_split.c_str(),
                 tables.empty() ? "" : ", but there are some of ",
                 tables.empty() ? "" : kind_of(tables.front().table).name);
}

std::uint64_t bytes_of(const std::vector<TableFiles>& tables) {
    std::uint64_t bytes = 0;
    for (const TableFiles& table : tables)
        for (const std::string& file : table.files) {
            std::error_code none;
            const std::uint64_t size = fs::file_size(os::path_of(file), none);
            if (!none) bytes += size;
        }
    return bytes;
}

std::string fingerprint_of(const std::vector<TableFiles>& tables) {
    std::string text;
    for (const TableFiles& table : tables)
        for (const std::string& file : table.files) {
            os::FileInfo info;
            const bool known = os::examine(file, info) == 0;
            text += format("%s %s %lld %lld\n", kind_of(table.table).name,
                           file.substr(os::name_start(file)).c_str(),
                           known ? lld(info.bytes) : -1LL, lld(info.changed_ns));
        }
    return text;
}

}  // namespace splat::tables
