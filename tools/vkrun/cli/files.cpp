#include "vkrun/cli/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <sstream>

#include "vkrun/cli/failure.h"

namespace vkrun {
namespace {

/// False with the reason in errno.
bool write_all(int file, const std::string& text) {
    for (std::size_t done = 0; done < text.size();) {
        const ssize_t written = write(file, text.data() + done, text.size() - done);
        if (written < 0 && errno == EINTR) continue;
        if (written == 0) errno = ENOSPC;
        if (written <= 0) return false;
        done += static_cast<std::size_t>(written);
    }
    return true;
}

/// Returns like write_all().
bool flush(int file) {
    while (fsync(file) != 0)
        if (errno != EINTR) return false;
    return true;
}

Failure cannot_write(const std::filesystem::path& path, const std::string& reason) {
    return {kFailed, "cannot write '" + path.string() + "': " + reason};
}

}  // namespace

void make_folder(const std::filesystem::path& path) {
    std::error_code failed;
    std::filesystem::create_directories(path, failed);
    if (failed)
        throw Failure(kFailed,
                      "cannot make the folder '" + path.string() + "': " + failed.message());
}

void check_target(const std::string& path, bool overwrite, const std::vector<std::string>& inputs) {
    std::error_code ignored;
    for (const std::string& input : inputs)
        if (std::filesystem::equivalent(path, input, ignored))
            throw Failure(kUsageError,
                          "'" + path + "' is what is read; write to a file of another name");
    if (!overwrite && std::filesystem::exists(path, ignored))
        throw Failure(kUsageError, "'" + path + "' is there already; --overwrite replaces it");
}

std::string one_file(const std::string& out, const std::string& name) {
    const std::filesystem::path path(out);
    std::error_code none;
    const bool folder = std::filesystem::exists(path, none)
                            ? std::filesystem::is_directory(path, none)
                            : !path.has_extension();
    return folder ? (path / name).string() : out;
}

std::string extension_of(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

void make_folder_of(const std::string& file) {
    const std::filesystem::path folder = std::filesystem::path(file).parent_path();
    if (!folder.empty()) make_folder(folder);
}

void check_no_run(const std::string& folder, const std::string& other) {
    std::error_code none;
    if (std::filesystem::exists(std::filesystem::path(folder) / "run.json", none))
        throw Failure(kUsageError, "'" + folder +
                                       "' is the folder of a training, whose report.html would be "
                                       "replaced; name another, such as '" +
                                       folder + "/" + other + "'");
}

void check_folder_of(const std::string& path) {
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    std::error_code none;
    if (!folder.empty() && !std::filesystem::is_directory(folder, none))
        throw cannot_write(path, "'" + folder.string() + "' is no folder");
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
                                            : ": No such file or directory"));
    file.peek();  // an empty file has no text to copy
    std::ostringstream text;
    text << file.rdbuf();
    if (!file) throw Failure(kUsageError, "cannot read '" + path + "'");
    return text.str();
}

void write_text(const std::string& path, const std::string& text) {
    if (path.empty()) return;
    std::error_code none;
    const std::filesystem::file_type kind = std::filesystem::status(path, none).type();
    const bool replaced = kind == std::filesystem::file_type::regular ||
                          kind == std::filesystem::file_type::not_found;
    if (replaced && !path.starts_with("/dev/")) return replace_file(path, text);
    std::ofstream file(path);
    file << text;
    if (!file.flush()) throw Failure(kFailed, "cannot write '" + path + "'");
}

void replace_file(const std::filesystem::path& path, const std::string& text) {
    std::error_code none;
    std::filesystem::path target = path;
    constexpr int kMostLinks = 40;  // limit of Linux
    for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(target, none); ++i)
        target = target.parent_path() / std::filesystem::read_symlink(target, none);
    struct stat old {};
    const bool replaced = stat(target.c_str(), &old) == 0;
    if (replaced ? !S_ISREG(old.st_mode) : errno == ELOOP)
        throw cannot_write(path, "it is not a regular file");
    const std::string suffix = "." + std::to_string(getpid()) + "-0.tmp";
    const std::string temporary =
        target.parent_path() /
        (target.filename().string().substr(0, NAME_MAX - suffix.size()) + suffix);
    const int file = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    bool ok = file >= 0;
    if (ok && replaced) static_cast<void>(fchmod(file, old.st_mode & 07777));
    ok = ok && write_all(file, text) && flush(file);
    int reason = errno;
    if (file >= 0 && close(file) != 0 && ok) {
        ok = false;
        reason = errno;
    }
    if (ok && std::rename(temporary.c_str(), target.c_str()) == 0) return;
    if (ok) reason = errno;
    std::remove(temporary.c_str());
    throw cannot_write(path, std::strerror(reason));
}

void append_text(const std::filesystem::path& path, const std::string& text) {
    // Does not wait for the reader of a FIFO.
    const int file =
        open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NONBLOCK | O_CLOEXEC, 0644);
    if (file < 0) throw cannot_write(path, std::strerror(errno));
    struct stat old {};
    const bool regular = fstat(file, &old) == 0 && S_ISREG(old.st_mode);
    const bool ok = regular && write_all(file, text);
    const int reason = errno;
    if (regular && !ok) static_cast<void>(ftruncate(file, old.st_size));
    close(file);
    if (!ok) throw cannot_write(path, regular ? std::strerror(reason) : "it is not a regular file");
}

}  // namespace vkrun
