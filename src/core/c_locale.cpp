#include "core/c_locale.h"

#include <cstdlib>

namespace splat {
namespace {

/// 0 where the system has none; the locale of the thread then stays.
locale_t c_locale() {
    static const locale_t locale = ::newlocale(LC_ALL_MASK, "C", nullptr);
    return locale;
}

}  // namespace

CLocale::CLocale() : before_(::uselocale(c_locale())) {}

CLocale::~CLocale() {
    ::uselocale(before_);
}

std::optional<double> decimal_number(const std::string& text) {
    const CLocale point;
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || end != text.c_str() + text.size()) return std::nullopt;
    return value;
}

}  // namespace splat
