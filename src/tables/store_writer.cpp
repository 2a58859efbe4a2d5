#include <algorithm>
#include <filesystem>
#include <regex>

#include "core/fault.h"
#include "core/log.h"
#include "core/os/path.h"
#include "io/folder.h"
#include "tables/journal.h"
#include "tables/store.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStoreFile = "store.json";
/// "import.json", "import_0_of_2.json", and what a killed io::write_file() leaves of one, "import.json.12-0.tmp".
constexpr const char* kJournals = R"(import(_\d+_of_\d+)?\.json(\.\d+-\d+\.tmp)?)";
/// What is no lock: other shards make theirs at any time, so that two looks at the folder may differ by some.
constexpr const char* kNoLocks = R"((?!lock(_start|_\d+_of_\d+)?$)[\s\S]*)";

/// "import.json", "import_0_of_2.json".
std::string part_name(const char* stem, const Part& part, const char* extension) {
    return part.count == 1 ? std::string(stem) + extension
                           : format("%s_%u_of_%u%s", stem, part.index, part.count, extension);
}

/// Names in a folder that match an expression.
std::vector<std::string> names_in(const fs::path& folder, const std::string& expression) {
    const std::regex wanted(expression);
    std::vector<std::string> names;
    std::error_code none;
    for (fs::directory_iterator entry(folder, none), end; !none && entry != end;
         entry.increment(none)) {
        std::string name = os::text_of(entry->path().filename());
        if (std::regex_match(name, wanted)) names.push_back(std::move(name));
    }
    return names;
}

Status remove_file(const fs::path& path) {
    std::error_code failed;
    if (SPLAT_FAULT("tables.remove"))
        failed = std::make_error_code(std::errc::io_error);
    else
        fs::remove(path, failed);
    return failed ? io::system_error(failed, "remove", os::text_of(path)) : Status();
}

/// Zeros fill the record.
Status put_text(RecordFile& records, std::uint64_t row, io::Bytes text, std::size_t bytes) {
    std::byte padded[kMaxPoseBytes] = {};
    std::ranges::copy(text, padded);
    return records.put(row, std::span(padded).first(bytes));
}

}  // namespace

Result<std::unique_ptr<StoreWriter>> StoreWriter::open(const std::string& folder, StoreIndex index,
                                                       bool replace, Part part) {
    if (index.frames.empty() || index.frames.size() > kMaxRows)
        return unsupported("%zu rows in a split, expected 1 to %llu", index.frames.size(),
                           llu(kMaxRows));
    SPLAT_TRY(place_objects(index));
    std::unique_ptr<StoreWriter> writer(new StoreWriter(folder, std::move(index), part));
    SPLAT_TRY(io::make_folders(os::path_of(folder)));
    SPLAT_TRY(writer->lock());
    SPLAT_ASSIGN(const FileLock start, writer->lock_start());
    SPLAT_TRY(writer->check(replace));
    if (!writer->complete_) SPLAT_TRY(writer->open_records());
    return writer;
}

Status StoreWriter::lock() {
    const bool alone = part_.count == 1;
    const std::string what = "'" + folder_ + "'";
    SPLAT_ASSIGN(lock_, lock_file(folder_ + "/lock",
                                  alone ? os::Lock::kExclusive : os::Lock::kShared, false, what));
    if (alone) return {};
    SPLAT_ASSIGN(part_lock_,
                 lock_file(folder_ + "/" + part_name("lock", part_, ""), os::Lock::kExclusive,
                           false, format("shard %u of %u of ", part_.index, part_.count) + what));
    return {};
}

/// Parts begin and end one after the other.
Result<FileLock> StoreWriter::lock_start() const {
    if (part_.count == 1) return FileLock();
    return lock_file(folder_ + "/lock_start", os::Lock::kExclusive, true, folder_);
}

Status StoreWriter::check(bool replace) {
    const fs::path folder = os::path_of(folder_);
    std::error_code failed;
    const bool has_store = fs::exists(folder / kStoreFile, failed);
    if (has_store && is_store_text(folder_)) {
        const auto found = read_store_text(folder_);
        complete_ = found.ok() && found.value().source == index_.source;
        if (complete_) return {};
        if (!replace)
            return invalid(
                "'%s' holds another import, or one of files that have changed since or of an "
                "earlier version: remove it, or choose another folder",
                folder_.c_str());
        log(LogLevel::kWarning,
            format("'%s' was imported from other tables, and is imported again", folder_.c_str()));
        SPLAT_TRY(claim());
        SPLAT_TRY(remove_file(folder / kStoreFile));
    } else if (has_store ||
               (names_in(folder, kJournals).empty() && !names_in(folder, kNoLocks).empty())) {
        return invalid("'%s' is there and is no store: choose another folder", folder_.c_str());
    }
    return read_journals();
}

/// What is begun from other tables begins anew: its rows lack their checksums or are written again.
Status StoreWriter::read_journals() {
    const fs::path folder = os::path_of(folder_);
    const std::string parts = part_.count == 1 ? "" : format(R"(_\d+_of_%u)", part_.count);
    const std::regex own_parts("import" + parts + R"(\.json)");
    for (const std::string& name : names_in(folder, kJournals)) {
        const auto journal = Journal::read(folder_, name);
        if (!name.ends_with(".json") || !journal || journal->source() != index_.source) continue;
        if (!std::regex_match(name, own_parts))
            return invalid(
                "'%s' holds '%s': the same import, begun in another number of shards; go "
                "on with that number, or remove the folder",
                folder_.c_str(), name.c_str());
        begun_ = true;
    }
    if (begun_) return is_done(part_) ? Status() : journal_of(part_).write(false);
    // Space of other shapes is given back before any is taken.
    SPLAT_TRY(claim());
    const std::string own = part_name("import", part_, ".json");
    for (const std::string& name : names_in(
             folder, R"((frame|pose|rgb|depth|normal|mask|name|intrinsics|views)(_crc)?\.npy|)" +
                     std::string(kJournals)))
        if (name != own) SPLAT_TRY(remove_file(folder / name));
    return journal_of(part_).write(false);
}

/// Without a journal the folder would not be taken for a store's if this process ended while it is cleared.
Status StoreWriter::claim() const {
    return Journal(folder_, part_name("import", part_, ".json"), "").write(false);
}

Journal StoreWriter::journal_of(const Part& part) const {
    return {folder_, part_name("import", part, ".json"), index_.source};
}

bool StoreWriter::is_done(const Part& part) const {
    const auto journal = Journal::read(folder_, part_name("import", part, ".json"));
    return journal && journal->source() == index_.source && journal->is_done();
}

Status StoreWriter::open_records() {
    const std::uint64_t rows = index_.frames.size();
    SPLAT_ASSIGN(records_[Table::kPoses], RecordFile::create(folder_, "pose", pose_shape(rows)));
    for (const Table map : index_.maps)
        SPLAT_SET(records_[map],
                  RecordFile::create(folder_, kind_of(map).map, image_shape(index_, map)));
    return {};
}

Status StoreWriter::put(Table table, std::uint64_t row, io::Bytes bytes) {
    RecordFile& records = *records_.at(table);
    if (table != Table::kPoses) return records.put(row, bytes);
    if (bytes.size() > kMaxPoseBytes)
        return damaged("%zu bytes, expected at most %zu", bytes.size(), kMaxPoseBytes);
    return put_text(records, row, bytes, kMaxPoseBytes);
}

bool StoreWriter::holds(Table table, std::uint64_t row) const {
    io::Buffer bytes(table == Table::kPoses ? kMaxPoseBytes : index_.image_bytes(table));
    return begun_ && records_.at(table)->read(row, bytes).ok();
}

Status StoreWriter::write_objects() const {
    const ObjectFiles& files = index_.object_files;
    if (files.objects == 0) return {};
    SPLAT_ASSIGN(const auto names, RecordFile::create(folder_, "name", name_shape(files)));
    SPLAT_ASSIGN(const auto intrinsics,
                 RecordFile::create(folder_, "intrinsics", intrinsics_shape(files)));
    SPLAT_ASSIGN(const auto views, RecordFile::create(folder_, "views", views_shape(files)));
    std::vector<std::uint32_t> counts;
    for (const StoreObject& object : index_.objects) {
        const std::size_t i = counts.size();
        SPLAT_TRY(put_text(*names, i, io::as_bytes(object.name), files.name_bytes));
        SPLAT_TRY(
            put_text(*intrinsics, i, io::as_bytes(object.intrinsics), files.intrinsics_bytes));
        counts.push_back(object.views);
    }
    SPLAT_TRY(views->put(0, std::as_bytes(std::span(counts))));
    for (RecordFile* const file : {names.get(), intrinsics.get(), views.get()})
        SPLAT_TRY(file->flush());
    return {};
}

Status StoreWriter::finish() {
    for (const auto& [table, records] : records_) SPLAT_TRY(records->flush());
    SPLAT_ASSIGN(const FileLock start, lock_start());
    if (part_.count > 1) SPLAT_TRY(journal_of(part_).write(true));
    for (Part other{0, part_.count}; other.index < part_.count; ++other.index)
        if (other.index != part_.index && !is_done(other)) return {};
    const std::uint64_t rows = index_.frames.size();
    SPLAT_ASSIGN(const auto frames, RecordFile::create(folder_, "frame", frame_shape(rows)));
    SPLAT_TRY(frames->put(0, std::as_bytes(std::span(index_.frames))));
    SPLAT_TRY(frames->flush());
    SPLAT_TRY(write_objects());
    SPLAT_TRY(io::write_file(folder_ + "/" + kStoreFile, io::as_bytes(store_text(index_))));
    std::error_code none;
    const fs::path folder = os::path_of(folder_);
    for (const std::string& name : names_in(folder, kJournals)) fs::remove(folder / name, none);
    complete_ = true;
    return {};
}

}  // namespace splat::tables
