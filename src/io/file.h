#pragma once

#include <cstdint>
#include <string>

#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

/// Larger files are refused unless the caller says otherwise.
inline constexpr std::uint64_t kMaxFileBytes = std::uint64_t{16} << 30;

/// The whole file. Errors: kInvalidArgument if it cannot be opened or read, is no regular file, is
/// larger than `max_bytes`, or changes its size meanwhile; with path and the system's reason.
Result<Buffer> read_file(const std::string& path, std::uint64_t max_bytes = kMaxFileBytes);

/// Replace the file, or create it. Whoever opens the path, also after a crash, finds the old
/// contents or the new ones, never a part: the bytes go to "<path>.<process>-<number>.tmp", to the
/// disk, and then to their name. Errors: kInvalidArgument with path and the system's reason; the old
/// file is left as it was and the temporary one is removed.
Status write_file(const std::string& path, Bytes bytes);

}  // namespace splat::io
