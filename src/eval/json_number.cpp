#include "eval/json_number.h"

#include <charconv>
#include <cmath>

namespace splat::eval {

void write_number(JsonWriter& json, double value) {
    if (!std::isfinite(value)) {
        json.raw("null");
        return;
    }
    // Numbers outside of this range have an exponent.
    const double size = std::abs(value);
    const bool fixed = size == 0 || (size >= 1e-4 && size < 1e15);
    char buffer[64];
    const std::to_chars_result end =
        std::to_chars(buffer, buffer + sizeof buffer, value,
                      fixed ? std::chars_format::fixed : std::chars_format::scientific);
    std::string text(buffer, end.ptr);
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    json.raw(text);
}

}  // namespace splat::eval
