#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

/// Write all bytes to an open file, which `path` names in errors: from `offset` on, else where the file stands.
/// Interrupted and short writes go on. Errors: as system_error(); a part of the bytes may be written.
Status write_all(int file, Bytes bytes, const std::string& path,
                 std::optional<std::uint64_t> offset = {});

}  // namespace splat::io
