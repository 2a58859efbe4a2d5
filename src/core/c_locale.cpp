#include "core/c_locale.h"

#include <cstdlib>

#include "core/os/locale.h"

namespace splat {
CLocale::CLocale() : before_(os::take_c_locale()) {}

CLocale::~CLocale() {
    os::give_locale_back(before_);
}

std::optional<double> decimal_number(const std::string& text) {
    const CLocale point;
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || end != text.c_str() + text.size()) return std::nullopt;
    return value;
}

}  // namespace splat
