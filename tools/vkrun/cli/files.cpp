#include "vkrun/cli/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
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

std::string read_text(const std::string& path) {
    std::ifstream file(path);
    file.peek();  // a folder can be opened, but not read
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
    // Shards write the same files at once.
    const std::string temporary = path.string() + "." + std::to_string(getpid()) + "-0.tmp";
    const int file = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    bool ok = file >= 0;
    for (std::size_t done = 0; ok && done < text.size();) {
        const ssize_t written = write(file, text.data() + done, text.size() - done);
        ok = written > 0;
        if (ok) done += static_cast<std::size_t>(written);
    }
    ok = ok && fsync(file) == 0;
    const int reason = errno;
    if (file >= 0) close(file);
    if (ok && std::rename(temporary.c_str(), path.c_str()) == 0) return;
    std::remove(temporary.c_str());
    throw Failure(kFailed, "cannot write '" + path.string() + "': " + std::strerror(reason));
}

}  // namespace vkrun
