#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/status.h"

namespace splat::eval {

/// The error of a line of a file of scores (kFormat).
Status refuse_line(const std::string& path, std::size_t line, const std::string& problem);

struct CsvRow {
    std::size_t line = 0;  ///< line where the row begins
    std::vector<std::string> fields;
};

/// Records of RFC 4180, whose lines may also end without a carriage return; empty lines are left out. A quoted field
/// may hold commas, line ends and, doubled, quotes. Errors: kFormat, naming `path` and line.
Result<std::vector<CsvRow>> csv_rows(std::string_view text, const std::string& path);

/// A field of a .csv, quoted where RFC 4180 asks for it.
std::string csv_field(const std::string& text);

/// printf of a score. C libraries and processors differ in the sign of a NaN, which has none here.
std::string decimal(const char* pattern, double value);

/// A decimal number, or "nan" or "inf", which mean that there is none. Nothing for other texts, and beyond a double.
std::optional<double> score_of(const std::string& text);

}  // namespace splat::eval
