#include "vkrun/cli/download.h"

#include <CLI/CLI.hpp>
#include <cerrno>
#include <filesystem>
#include <vector>

#include "core/os/child.h"
#include "core/os/console.h"
#include "core/os/path.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/sha256.h"
#include "vkrun/cli/text.h"

namespace vkrun {

const char* const kDownloadHelp =
    R"(The file is fetched by curl, over https only, also where the server sends elsewhere, into FILE.part. What breaks
off is kept there, and the same command goes on with it. The file gets its name when its SHA-256 is the known one;
another file is deleted. Where no hash is known, nothing is fetched without --unverified. Without curl, the commands
are printed. SPLAT_MIRROR=https://HOST/DIR names a server that has the same files under the same names.
)";

namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

constexpr const char* kHttps = "https://";

/// curl's exit statuses that say more than "it broke off".
enum CurlStatus : int { kCurlRefused = 22, kCurlCannotWrite = 23, kCurlCannotResume = 33 };

std::string shell_word(const std::string& text) {
    std::string made = "'";
    for (const char c : text) made += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return made + "'";
}

std::vector<std::string> curl_words(const Download& download) {
    return {"curl",
            "--fail",
            "--globoff",
            "--location",
            "--proto",
            "=https",
            "--proto-redir",
            "=https",
            "--connect-timeout",
            "60",
            "--speed-limit",
            "1",
            "--speed-time",
            "60",
            "--continue-at",
            "-",
            "--output",
            download.path + ".part",
            download.url};
}

/// PATH.part, open and locked: two downloads into one file would mix.
class PartFile {
  public:
    explicit PartFile(const std::string& path) : path_(path + ".part") {
        file_ = os::open(path_, os::Open::kUpdate);
        if (file_ == os::kNoHandle) fail("cannot write");
        if (os::lock(file_, os::Lock::kExclusive, false) == 0 && is_ours()) return;
        os::close(file_);
        throw Failure(kFailed, "'" + path_ + "' is being written by another download: wait for it");
    }
    ~PartFile() {
        if (bytes() == 0) remove();
        os::close(file_);
    }
    PartFile(const PartFile&) = delete;
    PartFile& operator=(const PartFile&) = delete;

    [[nodiscard]] std::uint64_t bytes() const {
        os::FileInfo info;
        return os::examine(file_, info) == 0 ? info.bytes : 0;
    }
    void restart() {
        if (os::resize(file_, 0) != 0) fail("cannot write");
    }
    void remove() { os::remove(path_); }
    void finish(const std::string& path) {
        if (os::flush(file_) != 0 || os::rename(path_, path) != 0) fail("cannot give its name to");
    }
    [[nodiscard]] const std::string& path() const { return path_; }

  private:
    /// Whether another download has not given the file its name in the meantime.
    [[nodiscard]] bool is_ours() const {
        os::FileInfo opened, named;
        return os::examine(file_, opened) == 0 && os::examine(path_, named) == 0 &&
               opened.number == named.number;
    }
    [[noreturn]] void fail(const char* what) const {
        throw Failure(kFailed, std::string(what) + " '" + path_ + "': " + os::reason(errno));
    }

    std::string path_;
    os::Handle file_ = os::kNoHandle;
};

/// The exit status of curl. Throws a Failure if it cannot be started.
int run_curl(const Download& download) {
    std::vector<std::string> words = curl_words(download);
    if (os::errors_on_terminal())
        words.insert(words.begin() + 1, "--progress-bar");
    else
        words.insert(words.begin() + 1, {"--silent", "--show-error"});
    os::Child child;
    const int failed = child.start(words, {});
    if (failed != 0)
        throw Failure(kFailed, "cannot start curl (" + os::reason(failed) +
                                   "): install it, or fetch the file by other means and check "
                                   "it:\n" +
                                   fetch_commands(download));
    const int status = child.wait();
    if (status < 0) throw Failure(kFailed, "cannot wait for curl");
    return status;
}

std::uint64_t room_for(const std::string& path) {
    std::error_code failed;
    const fs::space_info space =
        fs::space(fs::absolute(os::path_of(path), failed).parent_path(), failed);
    return failed ? ~std::uint64_t{0} : space.available;
}

void check_room(const Download& download, const PartFile& part) {
    const std::uint64_t there = part.bytes();
    const std::uint64_t room = room_for(part.path());
    if (download.bytes <= there || download.bytes - there <= room) return;
    throw Failure(kFailed, "no room for '" + download.path +
                               "': " + bytes_text(download.bytes - there) + " are missing, " +
                               bytes_text(room) + " are free there");
}

/// Fill the part, which then has the bytes of the file.
void fill_part(const Download& download, PartFile& part) {
    if (download.bytes != 0 && part.bytes() > download.bytes) part.restart();
    if (download.bytes != 0 && part.bytes() == download.bytes) return;
    check_room(download, part);
    const std::uint64_t before = part.bytes();
    int status = run_curl(download);
    if (status == kCurlCannotResume && part.bytes() > 0) {
        std::fprintf(stderr, "vkrun: note: the server cannot go on with '%s', so it starts again\n",
                     part.path().c_str());
        part.restart();
        status = run_curl(download);
    }
    const bool whole = part.bytes() >= download.bytes || part.bytes() == before;
    if (status == 0 && whole) return;  // else the server closed early, without a length to tell by
    const std::string address = "'" + download.url + "'";
    if (status == kCurlRefused) throw Failure(kFailed, "the server refuses " + address);
    const std::uint64_t bytes = part.bytes();
    std::string sentence = status == 0 ? address + " broke off"
                                       : address + format(" broke off: status %d of curl", status);
    if (status == kCurlCannotWrite)
        sentence = "cannot write '" + part.path() + "' any further (" +
                   bytes_text(room_for(part.path())) + " are free there)";
    if (bytes > 0)
        sentence += format("; %llu bytes", static_cast<unsigned long long>(bytes)) +
                    (download.bytes == 0
                         ? ""
                         : format(" of %llu", static_cast<unsigned long long>(download.bytes))) +
                    " are kept in '" + part.path() + "': the same command goes on with them";
    throw Failure(kFailed, sentence);
}

Json fetch_result(const Download& download, std::uint64_t bytes, const std::string& hash,
                  bool was_there) {
    return {{"file", download.path},
            {"address", download.url},
            {"bytes", bytes},
            {"sha256", hash},
            {"verified", !download.sha256.empty()},
            {"was_there", was_there}};
}

Json checked_file(const Download& download) {
    const std::string hash = sha256_of_file(download.path);
    if (download.sha256.empty() || hash == download.sha256)
        return fetch_result(download, fs::file_size(os::path_of(download.path)), hash, true);
    throw Failure(kBadData, "'" + download.path + "' is there with SHA-256 " + hash +
                                ", expected " + download.sha256 +
                                ": it is another file, or damaged; move it away, or name another "
                                "with --out");
}

void check_download(const Download& download, bool unverified) {
    if (!download.url.starts_with(kHttps))
        throw Failure(kUsageError, "'" + download.url +
                                       "' is not fetched: expected an address "
                                       "that starts with https://");
    if (!download.sha256.empty() || unverified) return;
    throw Failure(kUsageError,
                  "the SHA-256 of '" + os::text_of(os::path_of(download.path).filename()) +
                      "' is not known, so that what comes cannot be checked: --unverified fetches "
                      "it all the same");
}

}  // namespace

std::string mirrored(const std::string& url, const std::string& name) {
    std::string address = os::variable("SPLAT_MIRROR").value_or("");
    if (address.empty()) return url;
    if (!address.starts_with(kHttps))
        throw Failure(kUsageError, "SPLAT_MIRROR is '" + address +
                                       "', expected https://HOST or https://HOST/DIR");
    while (address.ends_with('/')) address.pop_back();
    return address + "/" + name;
}

std::string download_path(const std::string& out, const std::string& usual) {
    return out.empty() ? usual : one_file(out, os::text_of(os::path_of(usual).filename()));
}

std::string fetch_commands(const Download& download) {
    const std::string part = shell_word(download.path + ".part");
    std::string command;
    for (const std::string& word : curl_words(download)) {
        const bool plain =
            word.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-=") == std::string::npos;
        command += (command.empty() ? "" : " ") + (plain ? word : shell_word(word));
    }
    const std::string folder = os::text_of(os::path_of(download.path).parent_path());
    return (folder.empty() ? "  " : "  mkdir -p " + shell_word(folder) + " &&\n    ") + command +
           " &&\n" +
           (download.sha256.empty()
                ? ""
                : "    echo " + shell_word(download.sha256 + "  " + download.path + ".part") +
                      " | sha256sum -c &&\n") +
           "    mv " + part + " " + shell_word(download.path);
}

Json fetch(const Download& download, bool unverified) {
    check_download(download, unverified);
    std::error_code none;
    if (fs::exists(os::path_of(download.path), none)) return checked_file(download);
    if (const fs::path folder = os::path_of(download.path).parent_path(); !folder.empty())
        make_folder(folder);
    PartFile part(download.path);
    fill_part(download, part);
    const std::uint64_t bytes = part.bytes();
    const std::string hash = sha256_of_file(part.path());
    if (!download.sha256.empty() && hash != download.sha256) {
        part.remove();
        throw Failure(kBadData,
                      format("the %llu bytes from '", static_cast<unsigned long long>(bytes)) +
                          download.url + "' have SHA-256 " + hash + ", expected " +
                          download.sha256 +
                          ": they are of another file, or damaged, and are deleted");
    }
    part.finish(download.path);
    return fetch_result(download, bytes, hash, false);
}

std::string fetched_text(const Json& fetched) {
    const auto hash = fetched.at("sha256").get<std::string>();
    return fetched.at("file").get<std::string>() +
           (fetched.at("was_there").get<bool>() ? ": there already, " : ": ") +
           bytes_text(fetched.at("bytes").get<std::uint64_t>()) +
           (fetched.at("verified").get<bool>() ? ", its SHA-256 is the known one"
                                               : ", not verified, SHA-256 " + hash);
}

void add_download_options(CLI::App& command, std::string& out, bool& unverified,
                          const char* usual) {
    command.add_option("--out", out, std::string("Where the file goes; default: ") + usual)
        ->type_name("FILE|DIR");
    command.add_flag("--unverified", unverified, "Fetch a file whose hash is not known");
}

}  // namespace vkrun
