#include "core/os/locale.h"

#include <locale.h>
#if defined(__APPLE__)
#include <xlocale.h>
#endif

namespace splat::os {

void* take_c_locale() {
    static const locale_t locale = ::newlocale(LC_ALL_MASK, "C", nullptr);
    return locale == nullptr ? nullptr : ::uselocale(locale);
}

void give_locale_back(void* before) {
    if (before != nullptr) ::uselocale(static_cast<locale_t>(before));
}

}  // namespace splat::os
