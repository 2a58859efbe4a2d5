#pragma once

#include <cstdint>
#include <string>

namespace splat::os {

std::int64_t process_id();
/// The file of the running program; empty if the system does not say.
std::string program_file();
/// The file of another program in the folder of this one.
std::string program_beside(const std::string& name);
/// False only if there is no such process.
bool may_run(std::int64_t process);

/// Call these around every fork: `before`, and then `in_parent` or `in_child`. Windows has none.
void on_fork(void (*before)(), void (*in_parent)(), void (*in_child)());

}  // namespace splat::os
