#include "eval/csv_table.h"

#include <algorithm>
#include <cmath>

#include "core/c_locale.h"

namespace splat::eval {
namespace {

class CsvReader {
  public:
    CsvReader(std::string_view text, const std::string& path) : text_(text), path_(path) {}

    Result<std::vector<CsvRow>> rows() {
        std::vector<CsvRow> rows;
        while (at_ < text_.size()) {
            CsvRow row{line_, {}};
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

}  // namespace

Status refuse_line(const std::string& path, std::size_t line, const std::string& problem) {
    return damaged("'%s', line %zu: %s", path.c_str(), line, problem.c_str());
}

Result<std::vector<CsvRow>> csv_rows(std::string_view text, const std::string& path) {
    return CsvReader(text, path).rows();
}

std::string decimal(const char* pattern, double value) {
    return std::isnan(value) ? "nan" : format(pattern, value);
}

std::optional<double> score_of(const std::string& text) {
    const auto value = decimal_number(text);
    if (!value) return std::nullopt;
    const bool digits = text.find_first_of("0123456789") != std::string::npos;
    const bool hexadecimal = text.find_first_of("xX") != std::string::npos;
    if (hexadecimal || (digits && !std::isfinite(*value))) return std::nullopt;
    return value;
}

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string field = "\"";
    for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
    return field + "\"";
}

}  // namespace splat::eval
