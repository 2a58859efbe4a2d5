#include "self_test/notes.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <sstream>

#include "core/fork.h"

namespace splat::self_test {
namespace {

namespace fs = std::filesystem;

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

/// What follows `begin` in the first line that begins with it.
std::optional<std::string> noted(const std::string& path, const std::string& begin) {
    std::error_code none;
    if (path.empty() || !fs::is_regular_file(path, none)) return {};
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);)
        if (line.starts_with(begin)) return line.substr(begin.size());
    return {};
}

/// A folder that cannot be written, or something else in the file's place, only means another test next time.
void note(const std::string& path, std::string line) {
    std::error_code none;
    if (path.empty()) return;
    std::ranges::replace(line, '\n', ' ');
    fs::create_directories(fs::path(path).parent_path(), none);
    if (fs::exists(path, none) && !fs::is_regular_file(path, none)) return;
    std::ofstream(path, std::ios::app) << line << "\n";
}

/// The file, locked; -1 if it is not there, is no file, another test has it, or one has just removed it.
int open_locked(const std::string& path, int flags) {
    const int file = ::open(path.c_str(), flags | O_RDWR | O_CLOEXEC | O_NONBLOCK, 0644);
    struct stat info {};
    if (file < 0 ||
        (::fstat(file, &info) == 0 && S_ISREG(info.st_mode) &&
         ::flock(file, LOCK_EX | LOCK_NB) == 0 && ::fstat(file, &info) == 0 && info.st_nlink > 0))
        return file;
    ::close(file);
    return -1;
}

/// A call of exit() by another thread ends the test, too, and tells nothing of it.
struct AtExit {
    const pid_t process = ::getpid();  ///< a forked child has no test
    ~AtExit() {
        if (::getpid() != process) return;
        const std::lock_guard lock(known().mutex);
        for (const std::string& path : known().testing) ::unlink(path.c_str());
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
    : path_(file + ".testing"), descriptor_(-1) {
    static const AtExit at_exit;
    if (file.empty() || keys.empty()) return;
    std::string text;
    for (const std::string& key : keys) text += key + "\n";
    std::error_code none;
    fs::create_directories(fs::path(path_).parent_path(), none);
    const std::lock_guard lock(known().mutex);
    const auto added = known().testing.insert(path_);
    // From here on nothing needs memory.
    descriptor_ = open_locked(path_, O_CREAT);
    if (descriptor_ < 0)
        known().testing.erase(added);
    else
        static_cast<void>(!::write(descriptor_, text.data(), text.size()));  // a full disk: no note
}

Testing::~Testing() {
    if (descriptor_ < 0) return;
    ::unlink(path_.c_str());
    ::close(descriptor_);
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
    const int descriptor = file.empty() ? -1 : open_locked(path, 0);
    if (descriptor < 0) return {};
    std::string text(1 << 14, '\0');
    const ssize_t read = ::pread(descriptor, text.data(), text.size(), 0);
    std::istringstream lines(text.substr(0, static_cast<std::size_t>(std::max<ssize_t>(read, 0))));
    std::vector<std::string> keys;
    for (std::string key; std::getline(lines, key);) keys.push_back(key);
    if (remove) ::unlink(path.c_str());
    ::close(descriptor);
    return keys;
}

}  // namespace splat::self_test
