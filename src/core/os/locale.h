#pragma once

namespace splat::os {

/// Give this thread the locale "C". Returns what give_locale_back() takes; nullptr if the system has none, in which
/// case the thread keeps its own.
void* take_c_locale();
void give_locale_back(void* before);

}  // namespace splat::os
