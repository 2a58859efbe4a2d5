#include "core/c_locale.h"

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

}  // namespace splat
