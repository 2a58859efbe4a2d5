#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/os/path.h"
#include "core/status.h"

namespace splat::io {

/// What lies at a path, behind symbolic links.
enum class PathKind { kNothing, kFile, kFolder, kOther, kBrokenLink };

struct FolderEntry {
    std::string name;
    PathKind kind = PathKind::kNothing;
};

/// Errors: as system_error() if the system refuses to tell. That nothing is there is no error.
Result<PathKind> kind_of(const std::string& path);

/// True if a regular file is there. Errors: as kind_of().
Result<bool> has_file(const std::string& path);

/// Refuses a path below a folder that leads through symbolic links, which may lead out of it; `what` names the format.
Status check_no_links(const std::string& folder, const std::string& path, const std::string& what);

/// Make a folder, and those that it lies in. Errors: as system_error().
Status make_folders(const std::filesystem::path& path);

/// Write a folder by `write`, which gets `temporary`: `folder` appears whole or not at all. Errors: those of `write`;
/// as system_error().
Status write_folder(const std::filesystem::path& folder, const std::filesystem::path& temporary,
                    const std::function<Status(const std::filesystem::path&)>& write);

/// A path for it, of this call alone: ".<name>.<process>-<number>.tmp" beside the folder.
std::filesystem::path temporary_of(const std::filesystem::path& folder);

/// Names in a folder, as entries_in(), but no entry is looked at.
Result<std::vector<std::string>> names_in(const std::string& folder);

/// The entries of a folder, sorted by name, without those that start with '.'. Errors: as system_error(), also if an
/// entry cannot be looked at: a list is whole or an error.
Result<std::vector<FolderEntry>> entries_in(const std::string& folder);

/// Names of the folders among them.
Result<std::vector<std::string>> folders_in(const std::string& folder);

/// True if `holds` is true of a name; to recognise a format, where the unreadable entry is not the one that tells.
/// Errors: the first one of `holds`, if it is true of none.
Result<bool> holds_for_any(const std::vector<std::string>& names,
                           const std::function<Result<bool>(const std::string&)>& holds);

}  // namespace splat::io
