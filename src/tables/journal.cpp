#include "tables/journal.h"

#include <algorithm>
#include <filesystem>

#include "core/json_tree.h"
#include "core/json_writer.h"
#include "core/os/path.h"
#include "core/path_name.h"
#include "io/compress.h"
#include "io/file.h"
#include "io/folder.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kReadBytes = std::size_t{1} << 20;

std::string export_name(const std::string& split) {
    return "export_" + split + ".json";
}

/// CRC-32 of a file, read in pieces.
Result<Journal::File> file_of(const std::string& folder, const std::string& path) {
    Journal::File file{path};
    SPLAT_ASSIGN(const auto source, io::open_source(folder + "/" + path));
    file.bytes = source->size();
    io::Buffer piece;
    for (std::uint64_t at = 0; at < file.bytes; at += piece.size()) {
        piece.resize(std::min<std::uint64_t>(kReadBytes, file.bytes - at));
        SPLAT_TRY(source->read(at, piece));
        file.crc = io::crc32_of(piece, file.crc);
    }
    return file;
}

}  // namespace

std::optional<Journal> Journal::read(const std::string& folder, const std::string& name) {
    Journal journal(folder, name, "");
    const auto file = io::read_file(journal.path_, kMaxJsonBytes);
    if (!file.ok()) return std::nullopt;
    const auto tree = parse_json_tree(io::as_text(file.value()), "journal");
    if (!tree.ok() || tree.value()["source"].text() == nullptr) return std::nullopt;
    journal.source_ = *tree.value()["source"].text();
    journal.done_ = tree.value()["done"].find("all") != nullptr;
    for (const JsonTree& item : tree.value()["files"].items()) {
        const std::string* const path = item["path"].text();
        const auto bytes = item["bytes"].count(), crc = item["crc32"].count();
        if (path == nullptr || !check_below(*path).ok() || !bytes || !crc || *crc > UINT32_MAX)
            return std::nullopt;
        journal.files_.push_back({*path, *bytes, static_cast<std::uint32_t>(*crc)});
    }
    return journal;
}

Result<Journal> Journal::of_export(const std::string& folder, const std::string& split,
                                   const std::string& source,
                                   const std::vector<std::string>& targets) {
    SPLAT_TRY(io::make_folders(os::path_of(folder)));
    std::error_code failed;
    Journal journal(folder, export_name(split), source);
    if (!fs::exists(os::path_of(journal.path_), failed)) {
        for (const std::string& target : targets)
            if (fs::exists(os::path_of(target), failed))
                return invalid("'%s' is there and is no export: choose another folder",
                               target.c_str());
        SPLAT_TRY(journal.write(false));
        return journal;
    }
    const auto found = read(folder, export_name(split));
    if (found && found->source_ == source) return *found;
    return invalid(
        "'%s' holds another export of the split %s (%s), expected %s: choose another "
        "folder",
        folder.c_str(), split.c_str(), found ? found->source_.c_str() : "unreadable",
        source.c_str());
}

Status Journal::verify(const std::string& folder, const std::string& split) {
    const std::string path = folder + "/" + export_name(split);
    std::error_code none;
    if (!fs::exists(os::path_of(path), none)) return {};
    const auto journal = read(folder, export_name(split));
    if (!journal)
        return damaged("'%s' is damaged: remove it to read the tables unchecked", path.c_str());
    for (const File& file : journal->files_)
        if (!journal->holds(file.path))
            return damaged(
                "'%s/%s' is not the file of %llu bytes and CRC-32 %08x that '%s' lists: "
                "it is damaged, or was written by something else",
                folder.c_str(), file.path.c_str(), llu(file.bytes), file.crc, path.c_str());
    return {};
}

bool Journal::holds(const std::string& path) const {
    for (const File& file : files_) {
        if (file.path != path) continue;
        const auto found = file_of(folder_, path);
        return found.ok() && found.value().bytes == file.bytes && found.value().crc == file.crc;
    }
    return false;
}

Status Journal::add(const std::string& path) {
    SPLAT_ASSIGN(File file, file_of(folder_, path));
    std::erase_if(files_, [&path](const File& other) { return other.path == path; });
    files_.push_back(std::move(file));
    return write(false);
}

Status Journal::write(bool done) {
    done_ = done;
    JsonWriter json;
    json.begin_object().member("source", source_).key("files").begin_array();
    for (const File& file : files_) {
        json.newline(2).begin_object().member("path", file.path);
        json.member("bytes", file.bytes).member("crc32", file.crc).end();
    }
    json.newline().end();
    if (done_) json.key("done").begin_object().member("all", 1).end();
    json.end();
    return io::write_file(path_, io::as_bytes(json.text() + "\n"));
}

}  // namespace splat::tables
