#pragma once

#include <cstdint>
#include <string>

#include "vkrun/cli/json.h"

namespace CLI {
class App;
}

namespace vkrun {

/// A file that a server has.
struct Download {
    std::string url;          ///< https://
    std::string path;         ///< where it is wanted
    std::uint64_t bytes = 0;  ///< 0: not known
    std::string sha256;       ///< empty: not known
};

/// What downloads do and how they end, for the help of commands.
extern const char* const kDownloadHelp;

/// The address of a file: `url`, or the same name below $SPLAT_MIRROR. Throws a usage Failure for a mirror that
/// is not https.
std::string mirrored(const std::string& url, const std::string& name);

/// Where a file goes that --out names, or a folder for it; `usual` without --out.
std::string download_path(const std::string& out, const std::string& usual);

/// Commands for a shell that do what fetch() does.
std::string fetch_commands(const Download& download);

/// Fetch a file by curl, to PATH.part, which a second call goes on with, and give it its name once its hash is
/// the known one. A file that is there is left alone. Returns {"file", "address", "bytes", "sha256", "verified",
/// "was_there"}. Throws a Failure.
///
/// unverified  also fetch a file whose hash is not known
Json fetch(const Download& download, bool unverified);

/// What fetch() returned as a sentence.
std::string fetched_text(const Json& fetched);

/// --out and --unverified.
void add_download_options(CLI::App& command, std::string& out, bool& unverified, const char* usual);

}  // namespace vkrun
