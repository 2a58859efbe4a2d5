#include "eval/score_table.h"

#include <cmath>
#include <filesystem>
#include <optional>
#include <sstream>

#include "core/c_locale.h"
#include "core/shown.h"
#include "io/file.h"

namespace splat::eval {
namespace {

namespace fs = std::filesystem;

Status refuse_line(const std::string& path, std::size_t line, const std::string& problem) {
    return error(Code::kFormat, "'%s', line %zu: %s", path.c_str(), line, problem.c_str());
}

std::string table_path(const std::string& path) {
    std::error_code none;
    if (fs::is_directory(path, none)) return (fs::path(path) / "per_object.csv").string();
    if (fs::path(path).extension() == ".json")
        return (fs::path(path).parent_path() / "per_object.csv").string();
    return path;
}

std::vector<std::string> split(const std::string& line, char separator) {
    std::vector<std::string> parts;
    std::istringstream in(line);
    for (std::string part; std::getline(in, part, separator);)
        if (separator != ' ' || !part.empty()) parts.push_back(part);
    return parts;
}

/// The columns of a file that hold metrics.
struct Columns {
    char separator = ' ';
    std::vector<std::pair<std::string, std::size_t>> metrics;
};

Result<Columns> columns_of(const std::string& first, const std::string& path) {
    Columns columns;
    if (first.find(',') == std::string::npos) {
        for (std::size_t i = 0; i < std::size(kMetrics); ++i)
            columns.metrics.emplace_back(kMetrics[i], i + 1);
        return columns;
    }
    columns.separator = ',';
    const std::vector<std::string> names = split(first, ',');
    for (std::size_t i = 0; i < names.size(); ++i)
        for (const char* metric : kMetrics)
            if (names[i] == std::string(metric) + "_novel") columns.metrics.emplace_back(metric, i);
    if (names[0] != "object" || columns.metrics.empty())
        return refuse_line(path, 1,
                           "expected a heading with 'object' first and 'psnr_novel', 'ssim_novel' "
                           "or 'lpips_novel'");
    return columns;
}

/// The name without the number before it in scores.txt, which depends on the data set.
std::string object_name(const std::string& text, char separator) {
    if (separator == ',') return text;
    const std::size_t digits = text.find_first_not_of("0123456789");
    return digits != 0 && digits != std::string::npos && text[digits] == '_'
               ? text.substr(digits + 1)
               : text;
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

    Status take(const std::string& line, std::size_t number) {
        const std::vector<std::string> parts = split(line, columns_.separator);
        const std::size_t needed = columns_.metrics.back().second + 1;
        if (parts.size() < needed)
            return refuse_line(table_.path, number,
                               format("%zu columns, expected %zu or more", parts.size(), needed));
        const std::string name = object_name(parts[0], columns_.separator);
        const auto [place, fresh] = seen_.emplace(name, number);
        if (!fresh)
            return refuse_line(
                table_.path, number,
                format("object '%s' is in line %zu already", shown(name).c_str(), place->second));
        for (const auto& [metric, column] : columns_.metrics) {
            const std::string& text = parts[column];
            const std::optional<double> value = score_of(text);
            if (!value)
                return refuse_line(table_.path, number, "'" + shown(text) + "' is not a number");
            if (std::isfinite(*value)) table_.values[metric][name] = *value;
        }
        table_.objects = seen_.size();
        return {};
    }
    [[nodiscard]] bool has_heading() const { return columns_.separator == ','; }

  private:
    ScoreTable& table_;
    Columns columns_;
    std::map<std::string, std::size_t> seen_;
};

}  // namespace

Result<ScoreTable> read_scores(const std::string& path) {
    ScoreTable table;
    table.path = table_path(path);
    SPLAT_ASSIGN(const io::Buffer bytes, io::read_file(table.path));
    std::istringstream in{std::string(io::as_text(bytes))};
    std::string line;
    std::getline(in, line);
    SPLAT_ASSIGN(Columns columns, columns_of(line, table.path));
    TableLines lines(table, std::move(columns));
    std::size_t number = 1;
    if (!lines.has_heading() && !line.empty()) SPLAT_TRY(lines.take(line, number));
    while (std::getline(in, line)) {
        ++number;
        if (!line.empty()) SPLAT_TRY(lines.take(line, number));
    }
    if (table.objects == 0) return error(Code::kFormat, "'%s' holds no scores", table.path.c_str());
    list_metrics(table);
    return table;
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
        const auto& of_b = b.values.at(metric);
        for (const auto& [name, value] : a.values.at(metric)) {
            const auto other = of_b.find(name);
            if (!unpaired && other == of_b.end()) continue;
            samples.a.push_back(value);
            if (!unpaired) samples.b.push_back(other->second);
        }
        if (unpaired)
            for (const auto& [name, value] : of_b) samples.b.push_back(value);
        if (!samples.a.empty()) all.push_back(std::move(samples));
    }
    return all;
}

}  // namespace splat::eval
