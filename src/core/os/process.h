#pragma once

#include <cstdint>

namespace splat::os {

std::int64_t process_id();
/// False only if there is no such process.
bool may_run(std::int64_t process);

/// Call these around every fork: `before`, and then `in_parent` or `in_child`. Windows has none.
void on_fork(void (*before)(), void (*in_parent)(), void (*in_child)());

}  // namespace splat::os
