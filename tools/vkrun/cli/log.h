#pragma once

namespace vkrun {

/// Send the library's messages to standard error: warnings, or all of them after set_verbose(true).
void log_to_stderr();
void set_verbose(bool verbose);

}  // namespace vkrun
