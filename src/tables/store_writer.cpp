#include <filesystem>
#include <optional>

#include "core/json_tree.h"
#include "core/json_writer.h"
#include "core/log.h"
#include "tables/store.h"
#include "tables/store_index.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJournal = "import";
constexpr const char* kStoreFile = "store.json";
constexpr const char* kLockFile = "lock";
constexpr const char* kStartLock = "lock_start";
constexpr const char* kAll = "all";  ///< in a journal: its part is done

bool is_there(const fs::path& path) {
    std::error_code none;
    return fs::exists(path, none);
}

/// "import.json", "import_0_of_2.json".
std::string part_name(const char* stem, const Part& part, const char* extension) {
    return part.count == 1 ? std::string(stem) + extension
                           : format("%s_%u_of_%u%s", stem, part.index, part.count, extension);
}

/// The name of a journal is one of so many parts.
bool is_of_parts(const std::string& name, std::uint32_t count) {
    return count == 1 ? name == std::string(kJournal) + ".json"
                      : name.ends_with(format("_of_%u.json", count));
}

/// The name with '#' for each number.
std::string numbers_out(const std::string& name) {
    std::string pattern;
    for (const char c : name) {
        const bool digit = c >= '0' && c <= '9';
        if (!digit || !pattern.ends_with('#')) pattern += digit ? '#' : c;
    }
    return pattern;
}

/// "import.json", "import_0_of_2.json", and what a killed io::write_file() leaves of one:
/// "import.json.12-0.tmp".
bool is_journal(const std::string& name) {
    constexpr std::string_view kTemporary = ".#-#.tmp";
    std::string pattern = numbers_out(name);
    if (pattern.ends_with(kTemporary)) pattern.resize(pattern.size() - kTemporary.size());
    return pattern == "import.json" || pattern == "import_#_of_#.json";
}

bool is_lock(const std::string& name) {
    return name == kLockFile || name == kStartLock || numbers_out(name) == "lock_#_of_#";
}

bool is_any(const std::string& /*name*/) {
    return true;
}

/// Names in a folder that are so.
std::vector<std::string> names_in(const fs::path& folder, bool (*are)(const std::string&)) {
    std::vector<std::string> names;
    std::error_code none;
    for (fs::directory_iterator entry(folder, none), end; !none && entry != end;
         entry.increment(none)) {
        std::string name = entry->path().filename().string();
        if (are(name)) names.push_back(std::move(name));
    }
    return names;
}

/// The folder holds nothing, or only locks.
bool is_empty_folder(const fs::path& folder) {
    return names_in(folder, is_any).size() == names_in(folder, is_lock).size();
}

/// What a journal of this source says is done; nothing for another one, or a damaged one.
std::optional<std::map<std::string, std::uint64_t>> journal_of(const fs::path& path,
                                                               const std::string& source) {
    const auto file = io::read_file(path.string(), kMaxJsonBytes);
    if (!file.ok()) return std::nullopt;
    const auto tree = parse_json_tree(io::as_text(file.value()), kJournal);
    const JsonTree* const own = tree.ok() ? tree.value().find("source") : nullptr;
    const JsonTree* const parts = tree.ok() ? tree.value().find("done") : nullptr;
    const auto* const object =
        parts == nullptr ? nullptr : std::get_if<JsonTree::Object>(&parts->value);
    if (own == nullptr || own->text() == nullptr || *own->text() != source || object == nullptr)
        return std::nullopt;
    std::map<std::string, std::uint64_t> done;
    for (const auto& [name, count] : *object) done[name] = count.count().value_or(0);
    return done;
}

}  // namespace

Result<std::unique_ptr<StoreWriter>> StoreWriter::open(const std::string& folder, StoreIndex index,
                                                       bool replace, Part part) {
    if (index.frames.empty() || index.frames.size() > kMaxRows)
        return error(Code::kUnsupported, "%zu rows in a split, expected 1 to %llu",
                     index.frames.size(), static_cast<unsigned long long>(kMaxRows));
    SPLAT_TRY(store_text(index).status());  // what finish() could not write
    std::unique_ptr<StoreWriter> writer(new StoreWriter(folder, std::move(index), part));
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (failed) return io::system_error(failed.value(), "create the folder", folder);
    SPLAT_TRY(writer->lock());
    SPLAT_ASSIGN(const FileLock start, writer->lock_start());
    SPLAT_TRY(writer->check(replace));
    if (!writer->complete_) SPLAT_TRY(writer->open_records());
    return writer;
}

Status StoreWriter::lock() {
    const bool alone = part_.count == 1;
    const std::string what = "'" + folder_ + "'";
    SPLAT_ASSIGN(lock_,
                 FileLock::take(folder_ + "/" + kLockFile,
                                alone ? FileLock::Kind::kAlone : FileLock::Kind::kShared, what));
    if (alone) return {};
    SPLAT_ASSIGN(
        part_lock_,
        FileLock::take(folder_ + "/" + part_name(kLockFile, part_, ""), FileLock::Kind::kAlone,
                       format("shard %u of %u of ", part_.index, part_.count) + what));
    return {};
}

/// Parts begin and end one after the other.
Result<FileLock> StoreWriter::lock_start() const {
    if (part_.count == 1) return FileLock();
    return FileLock::take(folder_ + "/" + kStartLock, FileLock::Kind::kWait, folder_);
}

Status StoreWriter::check(bool replace) {
    const fs::path folder = folder_;
    const bool has_store = is_there(folder / kStoreFile);
    if (has_store && is_store_text(folder_)) {
        const auto found = read_store_text(folder_);
        complete_ = found.ok() && found.value().source == index_.source;
        if (complete_) return {};
        if (!replace)
            return error(
                Code::kInvalidArgument,
                "'%s' holds another import, or one of files that have changed since or of an "
                "earlier version: remove it, or choose another folder",
                folder_.c_str());
        log(LogLevel::kWarning,
            format("'%s' was imported from other tables, and is imported again", folder_.c_str()));
        std::error_code failed;
        fs::remove(folder / kStoreFile, failed);
        if (failed) return io::system_error(failed.value(), "remove", folder / kStoreFile);
    } else if (has_store || (names_in(folder, is_journal).empty() && !is_empty_folder(folder))) {
        return error(Code::kInvalidArgument, "'%s' is there and is no store: choose another folder",
                     folder_.c_str());
    }
    return read_journal();
}

/// What is begun from other tables begins anew: its rows lack their checksums or are written again.
Status StoreWriter::read_journal() {
    const fs::path folder = folder_;
    const std::string own = part_name(kJournal, part_, ".json");
    bool begun = false;
    for (const std::string& name : names_in(folder, is_journal)) {
        if (!name.ends_with(".json")) continue;
        auto done = journal_of(folder / name, index_.source);
        if (!done) continue;
        if (!is_of_parts(name, part_.count))
            return error(Code::kInvalidArgument,
                         "'%s' holds '%s': the same import, begun in another number of shards; go "
                         "on with that number, or remove the folder",
                         folder_.c_str(), name.c_str());
        begun = true;
        if (name == own) done_ = std::move(*done);
    }
    if (begun) return done_.empty() ? mark("", 0) : Status();
    // Space of other shapes is given back before any is taken.
    std::error_code none;
    for (const char* name : {"frame", "pose", "rgb", "depth", "normal", "mask"})
        for (const char* end : {".npy", "_crc.npy"})
            fs::remove(folder / (std::string(name) + end), none);
    for (const std::string& name : names_in(folder, is_journal)) fs::remove(folder / name, none);
    return mark("", 0);
}

Status StoreWriter::open_records() {
    const std::uint64_t rows = index_.frames.size();
    SPLAT_ASSIGN(records_[Table::kPoses], RecordWriter::open(folder_, "pose", pose_shape(rows)));
    for (const Table map : index_.maps) {
        SPLAT_ASSIGN(records_[map],
                     RecordWriter::open(folder_, kind_of(map).map, image_shape(index_, map)));
    }
    return {};
}

Status StoreWriter::put(Table table, std::uint64_t row, io::Bytes bytes) {
    RecordWriter& records = *records_.at(table);
    if (table != Table::kPoses) return records.put(row, bytes);
    if (bytes.size() > kMaxPoseBytes)
        return error(Code::kFormat, "%zu bytes, expected at most %zu", bytes.size(), kMaxPoseBytes);
    std::byte padded[kMaxPoseBytes] = {};
    std::copy(bytes.begin(), bytes.end(), padded);
    return records.put(row, padded);
}

bool StoreWriter::holds(Table table, std::uint64_t row) const {
    return records_.at(table)->holds(row);
}

std::uint64_t StoreWriter::done(const std::string& part) const {
    const auto found = done_.find(part);
    return found == done_.end() ? 0 : found->second;
}

Status StoreWriter::mark(const std::string& part, std::uint64_t count) {
    if (!part.empty()) done_[part] = count;
    JsonWriter json;
    json.begin_object().member("source", index_.source).key("done").begin_object();
    for (const auto& [name, number] : done_) json.member(name, number);
    json.end().end();
    return io::write_file(folder_ + "/" + part_name(kJournal, part_, ".json"),
                          io::as_bytes(json.text()));
}

/// All other parts are done.
bool StoreWriter::is_last() const {
    for (std::uint32_t i = 0; i < part_.count; ++i) {
        if (i == part_.index) continue;
        const auto done = journal_of(
            fs::path(folder_) / part_name(kJournal, {i, part_.count}, ".json"), index_.source);
        if (!done || done->count(kAll) == 0) return false;
    }
    return true;
}

Status StoreWriter::finish() {
    for (const auto& [table, records] : records_) SPLAT_TRY(records->flush());
    SPLAT_ASSIGN(const FileLock start, lock_start());
    if (part_.count > 1) SPLAT_TRY(mark(kAll, 1));
    if (!is_last()) return {};
    const std::uint64_t rows = index_.frames.size();
    SPLAT_ASSIGN(const auto frames, RecordWriter::open(folder_, "frame", frame_shape(rows)));
    SPLAT_TRY(frames->put(0, std::as_bytes(std::span(index_.frames))));
    SPLAT_TRY(frames->flush());
    SPLAT_ASSIGN(const std::string text, store_text(index_));
    SPLAT_TRY(io::write_file(folder_ + "/" + kStoreFile, io::as_bytes(text)));
    std::error_code none;
    for (const std::string& name : names_in(folder_, is_journal))
        fs::remove(fs::path(folder_) / name, none);
    complete_ = true;
    return {};
}

}  // namespace splat::tables
