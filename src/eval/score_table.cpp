#include "eval/score_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string_view>

#include "core/json_tree.h"
#include "core/os/path.h"
#include "core/shown.h"
#include "eval/csv_table.h"
#include "eval/saved_objects.h"
#include "io/file.h"

namespace splat::eval {
namespace {

namespace fs = std::filesystem;

constexpr const char* kObjectsTable = "per_object.csv";

std::string table_path(const std::string& path) {
    std::error_code none;
    if (fs::is_directory(os::path_of(path), none))
        return os::text_of(os::path_of(path) / kObjectsTable);
    if (os::path_of(path).extension() == ".json")
        return os::text_of(os::path_of(path).parent_path() / kObjectsTable);
    return path;
}

/// Fields that white space separates, of each line that is not empty.
std::vector<CsvRow> text_rows(std::string_view text) {
    std::vector<CsvRow> rows;
    std::istringstream in{std::string(text)};
    std::string line;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
        std::istringstream words(line);
        CsvRow row{number, {}};
        for (std::string word; words >> word;) row.fields.push_back(word);
        if (!row.fields.empty()) rows.push_back(std::move(row));
    }
    return rows;
}

/// The columns of a file that hold metrics.
struct Columns {
    bool heading = false;  ///< the first row is a heading (.csv)
    std::size_t count = 0;
    std::vector<std::pair<std::string, std::size_t>> metrics;
    std::size_t views = 0;  ///< 0: there is none
};

/// scores.txt has a name and these columns; its names may hold commas.
constexpr std::size_t kTextColumns = 1 + std::size(kMetrics);

bool is_text(std::string_view file) {
    const std::vector<CsvRow> first = text_rows(file.substr(0, file.find('\n')));
    return file.find(',') == std::string_view::npos ||
           (first.size() == 1 && first[0].fields.size() == kTextColumns);
}

Columns text_columns() {
    Columns columns{false, kTextColumns, {}};
    for (std::size_t i = 0; i < std::size(kMetrics); ++i)
        columns.metrics.emplace_back(kMetrics[i], i + 1);
    return columns;
}

Result<Columns> csv_columns(const std::vector<std::string>& names, const std::string& path) {
    Columns columns{true, names.size(), {}};
    for (std::size_t i = 1; i < names.size(); ++i)
        if (names[i] == "views") columns.views = i;
    for (std::size_t i = 0; i < names.size(); ++i)
        for (const char* metric : kMetrics)
            if (names[i] == std::string(metric) + "_novel") columns.metrics.emplace_back(metric, i);
    if (columns.count > 1 && names[1] == "view")
        return refuse_line(path, 1,
                           "scores of images, which of one object are not independent; expected "
                           "the per_object.csv beside it, of which the images are counted, too");
    if (names[0] != "object" || columns.metrics.empty())
        return refuse_line(path, 1,
                           "expected a heading with 'object' first and 'psnr_novel', 'ssim_novel' "
                           "or 'lpips_novel'");
    return columns;
}

/// The name of a column of scores.txt, without the number before it, which depends on the data set.
std::string object_name(const std::string& text) {
    std::string name;
    for (std::size_t i = 0; i < text.size(); ++i) {
        unsigned code = 0;
        const char* digits = text.data() + i + 1;
        const bool encoded = text[i] == '%' && i + 2 < text.size() &&
                             std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2;
        name += encoded ? static_cast<char>(code) : text[i];
        i += encoded ? 2 : 0;
    }
    const std::size_t digits = name.find_first_not_of("0123456789");
    return digits != 0 && digits != std::string::npos && name[digits] == '_'
               ? name.substr(digits + 1)
               : name;
}

/// Reads the lines after the heading.
class TableLines {
  public:
    TableLines(ScoreTable& table, Columns columns) : table_(table), columns_(std::move(columns)) {}

    Status take(const CsvRow& row) {
        const std::size_t number = row.line;
        if (row.fields.size() != columns_.count)
            return refuse_line(
                table_.path, number,
                format("%zu columns, expected %zu%s", row.fields.size(), columns_.count,
                       columns_.heading ? ", as in the heading" : ""));
        const std::string name = columns_.heading ? row.fields[0] : object_name(row.fields[0]);
        const auto [place, fresh] = seen_.emplace(name, number);
        if (!fresh)
            return refuse_line(
                table_.path, number,
                format("object '%s' is in line %zu already", shown(name).c_str(), place->second));
        for (const auto& [metric, column] : columns_.metrics) {
            const std::string& text = row.fields[column];
            if (text.empty()) continue;
            const std::optional<double> value = score_of(text);
            if (!value)
                return refuse_line(table_.path, number, "'" + shown(text) + "' is not a number");
            if (std::isfinite(*value)) table_.values[metric][name] = *value;
        }
        const auto views =
            columns_.views == 0 ? std::nullopt : score_of(row.fields[columns_.views]);
        if (views) table_.views[name] = *views;
        table_.objects.insert(name);
        return {};
    }

  private:
    ScoreTable& table_;
    Columns columns_;
    std::map<std::string, std::size_t> seen_;
};

/// The label of the views in objects.json beside a file; empty if there is none.
std::string protocol_beside(const std::string& path) {
    const auto bytes =
        io::read_file(os::text_of(os::path_of(path).parent_path() / kObjectsFile), kMaxJsonBytes);
    if (!bytes.ok()) return "";
    const auto tree = parse_json_tree(io::as_text(bytes.value()), kObjectsFile);
    if (!tree.ok() || tree.value()["views"].text() == nullptr) return "";
    std::string text = *tree.value()["views"].text();
    constexpr std::string_view kWithLpips = ", LPIPS";  // the views are the same
    if (text.ends_with(kWithLpips)) text.resize(text.size() - kWithLpips.size());
    return text;
}

}  // namespace

Status check_same_views(const ScoreTable& a, const ScoreTable& b) {
    constexpr const char* kRemedy =
        "their difference may come from the views: evaluate both with the same options";
    if (!a.protocol.empty() && !b.protocol.empty() && a.protocol != b.protocol)
        return invalid("A is scored with other views than B, A with '%s', B with '%s'; %s",
                       a.protocol.c_str(), b.protocol.c_str(), kRemedy);
    std::size_t others = 0;
    std::string first;
    for (const auto& [name, views] : a.views) {
        const auto found = b.views.find(name);
        if (found == b.views.end() || found->second == views) continue;
        if (++others == 1)
            first =
                format("'%s' has %g in A and %g in B", shown(name).c_str(), views, found->second);
    }
    if (others == 0) return {};
    return invalid("%zu objects are scored in other numbers of views: %s; %s", others,
                   first.c_str(), kRemedy);
}

Result<ScoreTable> read_scores(const std::string& path) {
    ScoreTable table;
    table.path = table_path(path);
    SPLAT_ASSIGN(const io::Buffer bytes, io::read_file(table.path));
    const std::string_view text = io::as_text(bytes);
    std::vector<CsvRow> rows;
    Columns columns = text_columns();
    if (is_text(text)) {
        rows = text_rows(text);
    } else {
        SPLAT_ASSIGN(rows, csv_rows(text, table.path));
        if (!rows.empty()) {
            SPLAT_ASSIGN(columns, csv_columns(rows[0].fields, table.path));
            rows.erase(rows.begin());
        }
    }
    TableLines lines(table, std::move(columns));
    for (const CsvRow& row : rows) SPLAT_TRY(lines.take(row));
    if (table.objects.empty()) return damaged("'%s' holds no scores", table.path.c_str());
    list_metrics(table);
    if (table.views.empty()) return table;
    table.protocol = protocol_beside(table.path);
    const fs::path file = os::path_of(table.path);
    if (file.filename() == kObjectsTable)
        SPLAT_SET(table.images, read_image_scores(os::text_of(file.parent_path())));
    return table;
}

std::string scores_name(const std::string& name) {
    std::string text;
    for (const char c : name) {
        const auto code = static_cast<unsigned char>(c);
        text +=
            code <= ' ' || code == 0x7F || c == '%' ? format("%%%02X", code) : std::string(1, c);
    }
    return text;
}

void list_metrics(ScoreTable& table) {
    table.metrics.clear();
    for (const char* metric : kMetrics)
        if (table.values.count(metric) != 0) table.metrics.emplace_back(metric);
}

std::vector<MetricSamples> samples_of(const ScoreTable& a, const ScoreTable& b, bool unpaired) {
    std::vector<MetricSamples> all;
    for (const std::string& metric : a.metrics) {
        if (b.values.count(metric) == 0) continue;
        MetricSamples samples{metric, {}, {}};
        const auto& of_a = a.values.at(metric);
        const auto& of_b = b.values.at(metric);
        for (const auto& [name, value] : of_b)
            if (a.objects.contains(name) && !of_a.contains(name)) ++samples.lacking_a;
        for (const auto& [name, value] : of_a) {
            const auto other = of_b.find(name);
            if (b.objects.contains(name) && other == of_b.end()) ++samples.lacking_b;
            if (!unpaired && other == of_b.end()) continue;
            samples.a.push_back(value);
            if (!unpaired) samples.b.push_back(other->second);
        }
        if (unpaired)
            for (const auto& [name, value] : of_b) samples.b.push_back(value);
        if (!samples.a.empty() && !samples.b.empty()) all.push_back(std::move(samples));
    }
    return all;
}

}  // namespace splat::eval
