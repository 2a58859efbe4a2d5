#include "self_test/notes.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <set>
#include <sstream>

#include "core/fork.h"
#include "core/os/path.h"
#include "core/os/process.h"

namespace splat::self_test {
namespace {

/// Locked for no longer than a look, as a fork waits for it.
struct Known {
    ForkMutex mutex;
    std::set<std::string> passed;
    std::map<std::string, std::string> failed;
    std::multiset<std::string> testing;  ///< paths
};
Known& known() {
    return for_ever<Known>();
}

/// A regular file, closed in the end; kNoHandle if there is none.
struct File : NoCopy {
    os::Handle handle;
    File(const std::string& path, os::Open how)
        : handle(path.empty() ? os::kNoHandle : os::open(path, how)) {
        os::FileInfo info;
        if (handle == os::kNoHandle ||
            (os::examine(handle, info) == 0 && info.kind == os::FileKind::kFile))
            return;
        os::close(handle);
        handle = os::kNoHandle;
    }
    ~File() {
        if (handle != os::kNoHandle) os::close(handle);
    }
};

/// What follows `begin` in the first line that begins with it.
std::optional<std::string> noted(const std::string& path, const std::string& begin) {
    constexpr std::size_t kMostBytes = 1 << 24;
    const File file(path, os::Open::kRead);
    std::string text;
    char part[4096];
    for (std::int64_t got = 0; file.handle != os::kNoHandle && text.size() < kMostBytes &&
                               (got = os::read(file.handle, part, sizeof part, {})) > 0;)
        text.append(part, static_cast<std::size_t>(got));
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
        if (line.starts_with(begin)) return line.substr(begin.size());
    return {};
}

/// A folder that cannot be written, or something else in the file's place, only means another test next time.
void note(const std::string& path, std::string line) {
    if (path.empty()) return;
    std::ranges::replace(line, '\n', ' ');
    line += '\n';
    os::make_folders(os::folder_of(path));
    const File file(path, os::Open::kAppend);
    if (file.handle != os::kNoHandle) os::write(file.handle, line.data(), line.size(), {});
}

/// The file, locked; kNoHandle if it is not there, is no file, another test has it, or one has just removed it.
os::Handle open_locked(const std::string& path, os::Open how) {
    const os::Handle file = os::open(path, how);
    os::FileInfo info;
    if (file == os::kNoHandle ||
        (os::examine(file, info) == 0 && info.kind == os::FileKind::kFile &&
         os::lock(file, os::Lock::kExclusive, false) == 0 && os::examine(file, info) == 0 &&
         info.links > 0))
        return file;
    os::close(file);
    return os::kNoHandle;
}

/// A call of exit() by another thread ends the test, too, and tells nothing of it.
struct AtExit {
    const std::int64_t process = os::process_id();  ///< a forked child has no test
    ~AtExit() {
        if (os::process_id() != process) return;
        const std::lock_guard lock(known().mutex);
        for (const std::string& path : known().testing) os::remove(path);
    }
};

}  // namespace

bool has_passed(const std::string& file, const std::string& key) {
    {
        const std::lock_guard lock(known().mutex);
        if (known().passed.contains(key)) return true;
    }
    return noted(file, "passed " + key + ".").has_value();
}

void note_passed(const std::string& file, const std::string& key) {
    note(file, "passed " + key + ".");
    const std::lock_guard lock(known().mutex);
    known().passed.insert(key);
}

std::optional<std::string> why_failed(const std::string& file, const std::string& key) {
    {
        const std::lock_guard lock(known().mutex);
        if (const auto at = known().failed.find(key); at != known().failed.end()) return at->second;
    }
    return noted(file, "failed " + key + ": ");
}

void note_failed(const std::string& file, const std::string& key, const std::string& why) {
    note(file, "failed " + key + ": " + why);
    const std::lock_guard lock(known().mutex);
    known().failed.emplace(key, why);
}

Testing::Testing(const std::string& file, const std::vector<std::string>& keys)
    : path_(file + ".testing"), handle_(os::kNoHandle) {
    static const AtExit at_exit;
    if (file.empty() || keys.empty()) return;
    std::string text;
    for (const std::string& key : keys) text += key + "\n";
    os::make_folders(os::folder_of(path_));
    const std::lock_guard lock(known().mutex);
    const auto added = known().testing.insert(path_);
    // From here on nothing needs memory.
    handle_ = open_locked(path_, os::Open::kUpdate);
    if (handle_ == os::kNoHandle)
        known().testing.erase(added);
    else
        os::write(handle_, text.data(), text.size(), {});  // a full disk: no note
}

Testing::~Testing() {
    if (handle_ == os::kNoHandle) return;
    os::remove(path_);
    os::close(handle_);
    const std::lock_guard lock(known().mutex);
    known().testing.erase(known().testing.find(path_));
}

void note_suspect(const std::string& file, const std::string& key, const std::string& why) {
    const bool again = noted(file, "suspect " + key + ".").has_value();
    if (!again) note(file, "suspect " + key + ".");
    note_failed(again ? file : "", key,
                why + (again ? ", twice" : "; the next process tests them again"));
}

std::vector<std::string> unfinished(const std::string& file, bool remove) {
    const std::string path = file + ".testing";
    const os::Handle handle =
        file.empty() ? os::kNoHandle : open_locked(path, os::Open::kUpdateOld);
    if (handle == os::kNoHandle) return {};
    std::string text(1 << 14, '\0');
    const std::int64_t read = os::read(handle, text.data(), text.size(), 0);
    std::istringstream lines(
        text.substr(0, static_cast<std::size_t>(std::max<std::int64_t>(read, 0))));
    std::vector<std::string> keys;
    for (std::string key; std::getline(lines, key);) keys.push_back(key);
    if (remove) os::remove(path);
    os::close(handle);
    return keys;
}

}  // namespace splat::self_test
