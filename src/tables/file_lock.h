#pragma once

#include <memory>
#include <string>

#include "core/os/file.h"
#include "core/status.h"

namespace splat::tables {

/// A lock of a file; it ends with its last copy in the process that took it.
using FileLock = std::shared_ptr<void>;

/// Lock a file, which is created where it is missing. Errors: kInvalidState if another process has it and this call
/// does not `wait`, with a sentence on `what` is in use; as io::system_error().
Result<FileLock> lock_file(const std::string& path, os::Lock kind, bool wait,
                           const std::string& what);

}  // namespace splat::tables
