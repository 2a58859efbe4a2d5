#include "vkrun/cli/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <sstream>

#include "vkrun/cli/failure.h"

namespace vkrun {

void make_folder(const std::filesystem::path& path) {
    std::error_code failed;
    std::filesystem::create_directories(path, failed);
    if (failed)
        throw Failure(kFailed,
                      "cannot make the folder '" + path.string() + "': " + failed.message());
}

void check_target(const std::string& path, bool overwrite) {
    std::error_code ignored;
    if (!overwrite && std::filesystem::exists(path, ignored))
        throw Failure(kUsageError, "'" + path + "' is there already; --overwrite replaces it");
}

std::ifstream open_to_read(const std::filesystem::path& path) {
    std::error_code none;
    std::ifstream file;
    if (std::filesystem::is_regular_file(path, none))
        file.open(path, std::ios::binary);
    else
        file.setstate(std::ios::failbit);
    return file;
}

std::string read_text(const std::string& path) {
    std::ifstream file = open_to_read(path);
    std::error_code none;
    if (!file.is_open())
        throw Failure(kUsageError, "cannot read '" + path + "'" +
                                       (std::filesystem::exists(path, none)
                                            ? ": it is not a regular file, or may not be read"
                                            : ""));
    file.peek();  // an empty file has no text to copy
    std::ostringstream text;
    text << file.rdbuf();
    if (!file) throw Failure(kUsageError, "cannot read '" + path + "'");
    return text.str();
}

void write_text(const std::string& path, const std::string& text) {
    if (path.empty()) return;
    std::ofstream file(path);
    file << text;
    if (!file.flush()) throw Failure(kFailed, "cannot write '" + path + "'");
}

void replace_file(const std::filesystem::path& path, const std::string& text) {
    std::error_code none;
    std::filesystem::path target = path;
    constexpr int kMostLinks = 40;  // as Linux
    for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(target, none); ++i)
        target = target.parent_path() / std::filesystem::read_symlink(target, none);
    struct stat old {};
    const bool replaced = stat(target.c_str(), &old) == 0;
    if (replaced ? !S_ISREG(old.st_mode) : errno == ELOOP)
        throw Failure(kFailed, "cannot write '" + path.string() + "': it is not a regular file");
    const std::string suffix = "." + std::to_string(getpid()) + "-0.tmp";
    const std::string temporary =
        target.parent_path() /
        (target.filename().string().substr(0, NAME_MAX - suffix.size()) + suffix);
    const int file = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    bool ok = file >= 0;
    if (ok && replaced) static_cast<void>(fchmod(file, old.st_mode & 07777));
    for (std::size_t done = 0; ok && done < text.size();) {
        const ssize_t written = write(file, text.data() + done, text.size() - done);
        ok = written > 0;
        if (ok) done += static_cast<std::size_t>(written);
    }
    ok = ok && fsync(file) == 0;
    int reason = errno;
    if (file >= 0) close(file);
    if (ok && std::rename(temporary.c_str(), target.c_str()) == 0) return;
    if (ok) reason = errno;
    std::remove(temporary.c_str());
    throw Failure(kFailed, "cannot write '" + path.string() + "': " + std::strerror(reason));
}

}  // namespace vkrun
