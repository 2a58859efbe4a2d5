#include "tables/table_samples.h"

#include <algorithm>

#include "synthetic/sample_folder.h"

namespace splat::test {

namespace fs = std::filesystem;

Status run_sql(const fs::path& folder, const std::vector<std::string>& statements) {
    SPLAT_ASSIGN(const auto session, tables::Session::open("", {folder.string()}));
    for (const std::string& statement : statements) {
        SPLAT_ASSIGN(const auto rows, session->query(statement));
        std::size_t count = 1;
        while (count > 0) {
            SPLAT_ASSIGN(count, rows->next());
        }
    }
    return {};
}

Result<std::string> ask_sql(const fs::path& folder, const std::string& query) {
    SPLAT_ASSIGN(const auto session, tables::Session::open("", {folder.string()}));
    SPLAT_ASSIGN(const auto rows,
                 session->query("SELECT CAST(x AS VARCHAR) FROM (" + query + ") AS t(x)"));
    SPLAT_ASSIGN(const std::size_t count, rows->next());
    if (count == 0 || rows->is_null(0, 0)) return std::string("nothing");
    return std::string(rows->text(0, 0));
}

Status convert(const fs::path& from, const std::string& split, data::Layout layout,
               const fs::path& to, const tables::Progress& progress) {
    data::DatasetDesc desc;
    desc.path = from.string();
    desc.split = split;
    desc.cache_bytes = 1;
    SPLAT_ASSIGN(const auto dataset, data::Dataset::open(desc));
    data::ExportDesc out;
    out.path = to.string();
    out.layout = layout;
    return data::export_dataset(*dataset, out, progress);
}

std::string tree_of(const fs::path& folder, const std::vector<std::string>& extensions) {
    std::vector<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file() && std::find(extensions.begin(), extensions.end(),
                                                 entry.path().extension()) != extensions.end())
            files.push_back(entry.path().lexically_relative(folder).string() + "\n" +
                            file_text(entry.path()));
    std::sort(files.begin(), files.end());
    std::string text;
    for (const std::string& file : files) text += file;
    return text;
}

}  // namespace splat::test
