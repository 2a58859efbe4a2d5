#include "vkrun/cli/files.h"

#include <cctype>
#include <cerrno>
#include <sstream>

#include "core/os/file.h"
#include "core/os/path.h"
#include "vkrun/cli/failure.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

/// False with the reason in errno.
bool write_all(os::Handle file, const std::string& text) {
    for (std::size_t done = 0; done < text.size();) {
        const std::int64_t written = os::write(file, text.data() + done, text.size() - done, {});
        if (written < 0 && errno == EINTR) continue;
        if (written == 0) errno = ENOSPC;
        if (written <= 0) return false;
        done += static_cast<std::size_t>(written);
    }
    return true;
}

/// Returns like write_all().
bool flush(os::Handle file) {
    while (os::flush(file) != 0)
        if (errno != EINTR) return false;
    return true;
}

/// Creates a file beside the target, or returns kNoHandle. A killed process of the same number, such as the first one
/// of a container, may have left files of such names.
os::Handle create_temporary(const std::string& target, std::string& path) {
    constexpr int kMostLeft = 100'000;
    os::Handle file = os::kNoHandle;
    for (int i = 0; file == os::kNoHandle && i < kMostLeft && (i == 0 || errno == EEXIST); ++i) {
        path = os::temporary_name(target);
        file = os::open(path, os::Open::kCreate);
    }
    return file;
}

Failure cannot_write(const std::string& path, const std::string& reason) {
    return {kFailed, "cannot write '" + path + "': " + reason};
}

}  // namespace

void make_folder(const fs::path& path) {
    make_folder(os::text_of(path));
}

void make_folder(const std::string& path) {
    if (os::make_folders(path) != 0)
        throw Failure(kFailed, "cannot make the folder '" + path + "': " + os::reason(errno));
}

void check_target(const std::string& path, bool overwrite, const std::vector<std::string>& inputs) {
    std::error_code ignored;
    for (const std::string& input : inputs)
        if (fs::equivalent(os::path_of(path), os::path_of(input), ignored))
            throw Failure(kUsageError,
                          "'" + path + "' is what is read; write to a file of another name");
    if (!overwrite && fs::exists(os::path_of(path), ignored))
        throw Failure(kUsageError, "'" + path + "' is there already; --overwrite replaces it");
}

std::string one_file(const std::string& out, const std::string& name) {
    const fs::path path = os::path_of(out);
    std::error_code none;
    const bool folder =
        fs::exists(path, none) ? fs::is_directory(path, none) : !path.has_extension();
    return folder ? os::text_of(path / os::path_of(name)) : out;
}

std::string extension_of(const fs::path& path) {
    std::string extension = os::text_of(path.extension());
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

std::string extension_of(const std::string& path) {
    return extension_of(os::path_of(path));
}

void make_folder_of(const std::string& file) {
    const fs::path folder = os::path_of(file).parent_path();
    if (!folder.empty()) make_folder(folder);
}

void check_no_run(const std::string& folder, const std::string& other) {
    std::error_code none;
    if (fs::exists(os::path_of(folder) / "run.json", none))
        throw Failure(kUsageError, "'" + folder +
                                       "' is the folder of a training, whose report.html would be "
                                       "replaced; name another, such as '" +
                                       folder + "/" + other + "'");
}

void check_folder_of(const std::string& path) {
    const std::string folder = os::text_of(os::path_of(path).parent_path());
    os::FileInfo info;
    if (!folder.empty() && (os::examine(folder, info) != 0 || info.kind != os::FileKind::kFolder))
        throw cannot_write(path, "'" + folder + "' is no folder");
}

std::ifstream open_to_read(const fs::path& path) {
    std::error_code none;
    std::ifstream file;
    if (fs::is_regular_file(path, none))
        file.open(path, std::ios::binary);
    else
        file.setstate(std::ios::failbit);
    return file;
}

std::ifstream open_to_read(const std::string& path) {
    return open_to_read(os::path_of(path));
}

std::string read_text(const std::string& path) {
    std::ifstream file = open_to_read(path);
    std::error_code none;
    if (!file.is_open())
        throw Failure(kUsageError, "cannot read '" + path + "'" +
                                       (fs::exists(os::path_of(path), none)
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
    const fs::file_type kind = fs::status(os::path_of(path), none).type();
    const bool replaced = kind == fs::file_type::regular || kind == fs::file_type::not_found;
    if (replaced && !path.starts_with("/dev/")) return replace_file(path, text);
    std::ofstream file(os::path_of(path), std::ios::binary);
    file << text;
    if (!file.flush()) throw Failure(kFailed, "cannot write '" + path + "'");
}

void replace_file(const fs::path& path, const std::string& text) {
    std::error_code none;
    fs::path behind_links = path;
    constexpr int kMostLinks = 40;  // limit of Linux
    for (int i = 0; i < kMostLinks && os::is_link(os::text_of(behind_links)); ++i) {
        const fs::path to = fs::read_symlink(behind_links, none);
        if (none) break;  // mingw's library reads none
        behind_links = behind_links.parent_path() / to;
    }
    const std::string target = os::text_of(behind_links);
    os::FileInfo old;
    const bool replaced = os::examine(target, old) == 0;
    if (replaced ? old.kind != os::FileKind::kFile : errno == ELOOP)
        throw cannot_write(os::text_of(path), "it is not a regular file");
    std::string temporary;
    const os::Handle file = create_temporary(target, temporary);
    const bool created = file != os::kNoHandle;
    if (created && replaced) os::set_permissions(file, old.permissions);
    bool ok = created && write_all(file, text) && flush(file);
    int reason = errno;
    if (created && os::close(file) != 0 && ok) {
        ok = false;
        reason = errno;
    }
    if (ok && os::rename(temporary, target) == 0) return;
    if (ok) reason = errno;
    if (created) os::remove(temporary);
    throw cannot_write(os::text_of(path), os::reason(reason));
}

void replace_file(const std::string& path, const std::string& text) {
    replace_file(os::path_of(path), text);
}

void append_text(const std::string& path, const std::string& text) {
    const os::Handle file = os::open(path, os::Open::kAppend);
    if (file == os::kNoHandle) throw cannot_write(path, os::reason(errno));
    os::FileInfo old;
    const bool regular = os::examine(file, old) == 0 && old.kind == os::FileKind::kFile;
    const bool ok = regular && write_all(file, text);
    const int reason = errno;
    if (regular && !ok) static_cast<void>(os::resize(file, old.bytes));
    os::close(file);
    if (!ok) throw cannot_write(path, regular ? os::reason(reason) : "it is not a regular file");
}

}  // namespace vkrun
