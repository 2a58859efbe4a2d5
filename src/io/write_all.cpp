#include "io/write_all.h"

#include <unistd.h>

#include <cerrno>

#include "core/fault.h"
#include "io/file.h"

namespace splat::io {
namespace {

ssize_t write_some(int file, Bytes bytes, std::optional<std::uint64_t> offset) {
    if (SPLAT_FAULT("io.write")) {
        errno = ENOSPC;
        return -1;
    }
    return offset ? ::pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(*offset))
                  : ::write(file, bytes.data(), bytes.size());
}

}  // namespace

Status write_all(int file, Bytes bytes, const std::string& path,
                 std::optional<std::uint64_t> offset) {
    while (!bytes.empty()) {
        const ssize_t written = write_some(file, bytes, offset);
        if (written < 0 && errno == EINTR) continue;
        if (written == 0) errno = ENOSPC;
        if (written <= 0) return system_error(errno, "write", path);
        bytes = bytes.subspan(static_cast<std::size_t>(written));
        if (offset) *offset += static_cast<std::uint64_t>(written);
    }
    return {};
}

}  // namespace splat::io
