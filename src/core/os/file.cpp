#include "core/os/file.h"

#include <cerrno>

#include "core/os/path.h"

namespace splat::os {

int make_folders(const std::string& path) {
    errno = EINVAL;
    if (path.empty()) return -1;
    if (make_folder(path) == 0) return 0;
    int number = errno;
    const std::string above = folder_of(path);
    if (number == ENOENT && above != path) {
        if (make_folders(above) != 0) return -1;
        if (make_folder(path) == 0) return 0;
        number = errno;
    }
    FileInfo info;
    // A name that no folder may have can be a device's, which is there.
    const bool there = number != EINVAL && examine(path, info) == 0;
    if (there && info.kind == FileKind::kFolder) return 0;
    errno = there ? ENOTDIR : number;
    return -1;
}

}  // namespace splat::os
