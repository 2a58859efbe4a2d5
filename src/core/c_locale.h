#pragma once

#include <optional>
#include <string>

#include "core/no_copy.h"

namespace splat {

/// While it lives, printf and strtod of this thread use a decimal point. A host may have set a locale with
/// decimal commas, in which numbers of files could not be read back.
class CLocale : NoCopy {
  public:
    CLocale();
    ~CLocale();

  private:
    void* before_;
};

/// The number that the whole text is, as strtod reads it, with a decimal point whatever the host's locale.
std::optional<double> decimal_number(const std::string& text);

}  // namespace splat
