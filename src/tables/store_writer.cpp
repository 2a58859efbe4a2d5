#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "core/fork.h"
#include "core/json_tree.h"
#include "core/json_writer.h"
#include "core/log.h"
#include "tables/store.h"
#include "tables/store_index.h"

namespace splat::tables {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJournal = "import.json";
constexpr const char* kStoreFile = "store.json";
constexpr const char* kLockFile = "lock";

bool is_there(const fs::path& path) {
    std::error_code none;
    return fs::exists(path, none);
}

/// The folder holds nothing, or only the lock.
bool is_empty_folder(const fs::path& folder) {
    std::error_code none;
    for (fs::directory_iterator entry(folder, none), end; !none && entry != end;
         entry.increment(none))
        if (entry->path().filename() != kLockFile) return false;
    return true;
}

}  // namespace

Result<std::unique_ptr<StoreWriter>> StoreWriter::open(const std::string& folder, StoreIndex index,
                                                       bool replace) {
    if (index.frames.empty() || index.frames.size() > kMaxRows)
        return error(Code::kUnsupported, "%zu rows in a split, expected 1 to %llu",
                     index.frames.size(), static_cast<unsigned long long>(kMaxRows));
    std::unique_ptr<StoreWriter> writer(new StoreWriter(folder, std::move(index)));
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (failed) return io::system_error(failed.value(), "create the folder", folder);
    SPLAT_TRY(writer->lock());
    SPLAT_TRY(writer->check(replace));
    if (!writer->complete_) SPLAT_TRY(writer->open_records());
    return writer;
}

StoreWriter::~StoreWriter() {
    if (lock_ < 0) return;
    // A forked child has the descriptor, too: without this the lock would last as long as the child.
    if (generation_ == fork_generation()) ::flock(lock_, LOCK_UN);
    ::close(lock_);
}

Status StoreWriter::lock() {
    const std::string path = folder_ + "/" + kLockFile;
    lock_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock_ < 0) return io::system_error(errno, "create", path);
    generation_ = fork_generation();
    if (::flock(lock_, LOCK_EX | LOCK_NB) == 0) return {};
    if (errno != EWOULDBLOCK) return io::system_error(errno, "lock", path);
    return error(Code::kInvalidState,
                 "'%s' is in use: another process imports into it; wait for its end",
                 folder_.c_str());
}

Status StoreWriter::check(bool replace) {
    const fs::path folder = folder_;
    if (is_there(folder / kStoreFile)) {
        const auto found = read_store_text(folder_);
        complete_ = found.ok() && found.value().source == index_.source;
        if (complete_) return {};
        if (!replace)
            return error(Code::kInvalidArgument,
                         "'%s' holds another import: remove it, or choose another folder",
                         folder_.c_str());
        log(LogLevel::kWarning,
            format("'%s' was imported from other tables, and is imported again", folder_.c_str()));
        std::error_code failed;
        fs::remove(folder / kStoreFile, failed);
        if (failed) return io::system_error(failed.value(), "remove", folder / kStoreFile);
    } else if (!is_there(folder / kJournal) && !is_empty_folder(folder)) {
        return error(Code::kInvalidArgument, "'%s' is there and is no store: choose another folder",
                     folder_.c_str());
    }
    return read_journal();
}

/// What is begun from other tables begins anew: its rows lack their checksums or are written again.
Status StoreWriter::read_journal() {
    const std::string path = folder_ + "/" + kJournal;
    const auto file = io::read_file(path, kMaxJsonBytes);
    if (file.ok()) {
        const auto tree = parse_json_tree(io::as_text(file.value()), kJournal);
        const JsonTree* const source = tree.ok() ? tree.value().find("source") : nullptr;
        const JsonTree* const parts = tree.ok() ? tree.value().find("done") : nullptr;
        const auto* const object =
            parts == nullptr ? nullptr : std::get_if<JsonTree::Object>(&parts->value);
        if (source != nullptr && source->text() != nullptr && *source->text() == index_.source &&
            object != nullptr) {
            for (const auto& [name, count] : *object)
                done_[name] = static_cast<std::uint64_t>(count.number().value_or(0));
            return {};
        }
    }
    // Space of other shapes is given back before any is taken.
    for (const char* name : {"frame", "pose", "rgb", "depth", "normal", "mask"})
        for (const char* end : {".npy", "_crc.npy"}) {
            std::error_code none;
            fs::remove(fs::path(folder_) / (std::string(name) + end), none);
        }
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
    return io::write_file(folder_ + "/" + kJournal, io::as_bytes(json.text()));
}

Status StoreWriter::finish() {
    const std::uint64_t rows = index_.frames.size();
    SPLAT_ASSIGN(const auto frames, RecordWriter::open(folder_, "frame", frame_shape(rows)));
    SPLAT_TRY(frames->put(0, std::as_bytes(std::span(index_.frames))));
    SPLAT_TRY(frames->flush());
    for (const auto& [table, records] : records_) SPLAT_TRY(records->flush());
    SPLAT_ASSIGN(const std::string text, store_text(index_));
    SPLAT_TRY(io::write_file(folder_ + "/" + kStoreFile, io::as_bytes(text)));
    std::error_code none;
    fs::remove(fs::path(folder_) / kJournal, none);
    complete_ = true;
    return {};
}

}  // namespace splat::tables
