#include "vkrun/compare/score_file.h"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "vkrun/cli/failure.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMetrics[] = {"psnr", "ssim", "lpips"};

[[noreturn]] void refuse(const std::string& path, std::size_t line, const std::string& problem) {
    throw Failure(kBadData, format("'%s', line %zu: %s", path.c_str(), line, problem.c_str()));
}

std::string table_path(const std::string& path) {
    if (fs::is_directory(path)) return (fs::path(path) / "per_object.csv").string();
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

/// "nan" and "inf" are numbers here; the caller skips them.
double number(const std::string& text, const std::string& path, std::size_t line) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0') refuse(path, line, "'" + text + "' is not a number");
    return value;
}

/// The columns of a file that hold metrics.
struct Columns {
    char separator = ' ';
    std::vector<std::pair<std::string, std::size_t>> metrics;
};

Columns columns_of(const std::string& first, const std::string& path) {
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
        refuse(path, 1,
               "expected a heading with 'object' first and 'psnr_novel', 'ssim_novel' or "
               "'lpips_novel'");
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

}  // namespace

ScoreFile read_scores(const std::string& path) {
    ScoreFile scores;
    scores.path = table_path(path);
    std::ifstream in(scores.path);
    if (!in) throw Failure(kBadData, "cannot open '" + scores.path + "': " + std::strerror(errno));
    std::string line;
    std::size_t count = 0;
    Columns columns;
    std::map<std::string, std::size_t> seen;
    while (std::getline(in, line)) {
        ++count;
        if (count == 1) columns = columns_of(line, scores.path);
        if ((count == 1 && columns.separator == ',') || line.empty()) continue;
        const std::vector<std::string> parts = split(line, columns.separator);
        if (parts.size() <= columns.metrics.back().second)
            refuse(scores.path, count,
                   format("%zu columns, expected %zu or more", parts.size(),
                          columns.metrics.back().second + 1));
        const std::string name = object_name(parts[0], columns.separator);
        const auto [place, fresh] = seen.emplace(name, count);
        if (!fresh)
            refuse(scores.path, count,
                   format("object '%s' is in line %zu already", name.c_str(), place->second));
        for (const auto& [metric, column] : columns.metrics) {
            const double value = number(parts[column], scores.path, count);
            if (std::isfinite(value)) scores.values[metric][name] = value;
        }
    }
    scores.objects = seen.size();
    if (seen.empty()) throw Failure(kBadData, "'" + scores.path + "' holds no scores");
    for (const char* metric : kMetrics)
        if (scores.values.count(metric) != 0) scores.metrics.emplace_back(metric);
    return scores;
}

std::vector<MetricSamples> samples_of(const ScoreFile& a, const ScoreFile& b, bool unpaired) {
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

}  // namespace vkrun
