#include "core/os/locale.h"

#include <clocale>
#include <memory>
#include <string>

namespace splat::os {

namespace {

struct Before {
    int mode = 0;
    std::string name;
};

}  // namespace

void* take_c_locale() {
    const int mode = ::_configthreadlocale(_ENABLE_PER_THREAD_LOCALE);
    const char* const name = std::setlocale(LC_ALL, nullptr);
    auto* const before = new Before{mode, name == nullptr ? "C" : name};
    std::setlocale(LC_ALL, "C");
    return before;
}

void give_locale_back(void* taken) {
    const std::unique_ptr<Before> before(static_cast<Before*>(taken));
    if (before == nullptr) return;
    std::setlocale(LC_ALL, before->name.c_str());
    ::_configthreadlocale(before->mode);
}

}  // namespace splat::os
