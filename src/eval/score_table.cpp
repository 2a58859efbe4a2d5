#include "eval/score_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string_view>

#include "core/c_locale.h"
#include "core/json_tree.h"
#include "core/os/path.h"
#include "core/shown.h"
#include "eval/saved_objects.h"
#include "io/file.h"

namespace splat::eval {
namespace {

namespace fs = std::filesystem;

Status refuse_line(const std::string& path, std::size_t line, const std::string& problem) {
    return damaged("'%s', line %zu: %s", path.c_str(), line, problem.c_str());
}

std::string table_path(const std::string& path) {
    std::error_code none;
    if (fs::is_directory(os::path_of(path), none))
        return os::text_of(os::path_of(path) / "per_object.csv");
    if (os::path_of(path).extension() == ".json")
        return os::text_of(os::path_of(path).parent_path() / "per_object.csv");
    return path;
}

struct Row {
    std::size_t line = 0;  ///< line where the row begins
    std::vector<std::string> fields;
};

/// Fields that white space separates, of each line that is not empty.
std::vector<Row> text_rows(std::string_view text) {
    std::vector<Row> rows;
    std::istringstream in{std::string(text)};
    std::string line;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
        std::istringstream words(line);
        Row row{number, {}};
        for (std::string word; words >> word;) row.fields.push_back(word);
        if (!row.fields.empty()) rows.push_back(std::move(row));
    }
    return rows;
}

/// Reads records of RFC 4180, whose lines may also end without a carriage return. A quoted field may hold commas,
/// line ends and, doubled, quotes.
class CsvReader {
  public:
    CsvReader(std::string_view text, const std::string& path) : text_(text), path_(path) {}

    Result<std::vector<Row>> rows() {
        std::vector<Row> rows;
        while (at_ < text_.size()) {
            Row row{line_, {}};
            do {
                SPLAT_ASSIGN(std::string field, take_field());
                row.fields.push_back(std::move(field));
            } while (take(','));
            take('\r');
            if (at_ < text_.size() && !take('\n'))
                return refuse_line(path_, line_, "a quoted field goes on behind its quote");
            ++line_;
            if (row.fields.size() > 1 || !row.fields[0].empty()) rows.push_back(std::move(row));
        }
        return rows;
    }

  private:
    bool take(char c) {
        if (at_ == text_.size() || text_[at_] != c) return false;
        ++at_;
        return true;
    }

    Result<std::string> take_field() {
        if (take('"')) return take_quoted();
        const std::size_t end = std::min(text_.find_first_of(",\n", at_), text_.size());
        std::string field(text_.substr(at_, end - at_));
        if (field.ends_with('\r')) field.pop_back();
        at_ = end;
        return field;
    }

    Result<std::string> take_quoted() {
        const std::size_t begun = line_;
        std::string field;
        for (; at_ < text_.size(); ++at_) {
            if (text_[at_] == '"' && (++at_ == text_.size() || text_[at_] != '"')) return field;
            line_ += text_[at_] == '\n' ? 1 : 0;
            field += text_[at_];
        }
        return refuse_line(path_, begun, "a quoted field has no end");
    }

    std::string_view text_;
    const std::string& path_;
    std::size_t at_ = 0;
    std::size_t line_ = 1;
};

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
    const std::vector<Row> first = text_rows(file.substr(0, file.find('\n')));
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

/// A decimal number, or "nan" or "inf", which mean that there is none. Nothing for other texts, and beyond a double.
std::optional<double> score_of(const std::string& text) {
    const auto value = decimal_number(text);
    if (!value) return std::nullopt;
    const bool digits = text.find_first_of("0123456789") != std::string::npos;
    const bool hexadecimal = text.find_first_of("xX") != std::string::npos;
    if (hexadecimal || (digits && !std::isfinite(*value))) return std::nullopt;
    return value;
}

/// Reads the lines after the heading.
class TableLines {
  public:
    TableLines(ScoreTable& table, Columns columns) : table_(table), columns_(std::move(columns)) {}

    Status take(const Row& row) {
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
    std::vector<Row> rows;
    Columns columns = text_columns();
    if (is_text(text)) {
        rows = text_rows(text);
    } else {
        SPLAT_ASSIGN(rows, CsvReader(text, table.path).rows());
        if (!rows.empty()) {
            SPLAT_ASSIGN(columns, csv_columns(rows[0].fields, table.path));
            rows.erase(rows.begin());
        }
    }
    TableLines lines(table, std::move(columns));
    for (const Row& row : rows) SPLAT_TRY(lines.take(row));
    if (table.objects.empty()) return damaged("'%s' holds no scores", table.path.c_str());
    list_metrics(table);
    if (!table.views.empty()) table.protocol = protocol_beside(table.path);
    return table;
}

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string field = "\"";
    for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
    return field + "\"";
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
