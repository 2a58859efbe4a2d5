#include "vkrun/cli/temporary_folder.h"

#include <cerrno>

#include "core/os/console.h"
#include "core/os/path.h"
#include "vkrun/cli/failure.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

constexpr const char* kPrefix = "vkrun-";
constexpr const char* kLock = "/.vkrun-lock";

/// A file in each of our folders, locked as long as its process lives; kNoHandle: it is not ours.
/// Others can neither read it nor put a link in its place: the folder is its user's alone (0700).
os::Handle lock_in(const std::string& folder, os::Open how) {
    if (os::is_link(folder + kLock)) return os::kNoHandle;
    const os::Handle file = os::open(folder + kLock, how);
    if (file == os::kNoHandle || os::lock(file, os::Lock::kExclusive, false) == 0) return file;
    os::close(file);
    return os::kNoHandle;
}

void remove_folder(const std::string& folder) {
    std::error_code ignored;
    fs::remove_all(os::path_of(folder), ignored);
}

/// What killed processes of this user left: folders with a lock that nobody holds.
void remove_stale() {
    std::vector<os::Listed> all;
    const std::string place = os::temporary_place();
    static_cast<void>(os::list(place, all));  // making a folder says what is wrong with it
    for (const os::Listed& one : all) {
        const std::string folder = (place + "/").append(one.name);
        if (!one.name.starts_with(kPrefix) || !os::is_own_folder(folder)) continue;
        const os::Handle lock = lock_in(folder, os::Open::kRead);
        if (lock == os::kNoHandle) continue;
        os::close(lock);  // Windows keeps what is open
        remove_folder(folder);
    }
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
    remove_stale();
    path_ = os::text_of(os::path_of(os::temporary_place()) /
                        os::path_of(std::string(kPrefix) + "XXXXXX"));
    if (os::make_temporary_folder(path_) != 0)
        throw Failure(kFailed, "cannot make a folder like '" + path_ + "': " + os::reason(errno) +
                                   "; set " + os::kTemporaryVariable + " to another place");
    lock_ = lock_in(path_, os::Open::kCreate);
    removed_by_interrupt_ = os::remove_when_interrupted(path_);
}

TemporaryFolder::~TemporaryFolder() {
    if (lock_ != os::kNoHandle) os::close(lock_);
    remove_folder(path_);
    if (removed_by_interrupt_) os::keep_when_interrupted();
}

}  // namespace vkrun
