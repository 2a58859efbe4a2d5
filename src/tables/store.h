#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/json.h"
#include "core/status.h"
#include "tables/file_lock.h"
#include "tables/journal.h"
#include "tables/record_file.h"
#include "tables/table_kind.h"

namespace splat::tables {

/// One split of a data set as files for random access, in a folder:
///
///   store.json          format, version, split, resolution, maps, source, and of each object name, views and
///                       intrinsics; written last
///   frame.npy           int64 [1,rows], numbers of the views; rows are ordered by object and frame
///   pose.npy            text [rows] of SRN's pose files
///   rgb.npy, depth.npy, normal.npy, mask.npy     uint8 [rows,channels,S,S] ([rows,S,S] of one channel)
///   name.npy, intrinsics.npy, views.npy     of more objects than store.json can hold: text [objects], uint32
///                       [1,objects]; store.json then has their number and the lengths of both texts (version 2)
///   *_crc.npy           uint32 [rows], CRC-32 of each row
///   import.json, lock   while it is written; in parts import_<index>_of_<count>.json, and locks alike
struct StoreObject {
    std::string name, intrinsics;
    std::uint32_t views = 0;
};

/// Objects that lie in files of their own: how many, and the bytes of a name and of intrinsics.
struct ObjectFiles {
    std::uint64_t objects = 0;  ///< 0: they lie in store.json
    std::uint64_t name_bytes = 0, intrinsics_bytes = 0;
};

struct StoreIndex {
    std::string split;
    std::string source;            ///< equal texts, equal contents
    std::uint32_t resolution = 0;  ///< S
    std::vector<Table> maps;       ///< kinds of images, rgb first
    std::vector<StoreObject> objects;
    ObjectFiles object_files;
    std::vector<std::int64_t> frames;  ///< frame number of each row

    [[nodiscard]] std::uint64_t image_bytes(Table map) const {
        return std::uint64_t{kind_of(map).channels} * resolution * resolution;
    }
};

inline constexpr std::size_t kMaxPoseBytes = 512;
inline constexpr std::size_t kMaxIntrinsicsBytes = 512;
inline constexpr std::size_t kMaxNameBytes = 512;  ///< in name.npy
/// Most rows of a store; their frame numbers are kept in memory.
inline constexpr std::uint64_t kMaxRows = std::uint64_t{1} << 23;

/// Set index.object_files, unless it is set, if store.json would have more than `most` bytes. Errors: kInvalidArgument
/// for names that are not UTF-8; kUnsupported for texts that are too long for files of their own.
Status place_objects(StoreIndex& index, std::size_t most = kMaxJsonBytes);

/// store.json, without the frames, and without the objects if they have files of their own.
std::string store_text(const StoreIndex& index);

/// The same read back; frames are as many zeros as there are rows. Errors: kFormat, kUnsupported.
Result<StoreIndex> read_store_text(const std::string& folder);

/// True if store.json is that of a store, of any version and perhaps damaged, and not another program's.
bool is_store_text(const std::string& folder);

RecordShape frame_shape(std::uint64_t rows);
RecordShape pose_shape(std::uint64_t rows);
RecordShape views_shape(const ObjectFiles& files);
RecordShape name_shape(const ObjectFiles& files);
RecordShape intrinsics_shape(const ObjectFiles& files);
RecordShape image_shape(const StoreIndex& index, Table map);

Result<bool> is_store(const std::string& folder);

/// Reads a store. Thread-safe.
class Store {
  public:
    /// Errors: kNotFound; kFormat for damaged files; kUnsupported for another version.
    static Result<std::unique_ptr<Store>> open(const std::string& folder);

    /// Without the intrinsics of the objects.
    [[nodiscard]] const StoreIndex& index() const { return index_; }
    /// The objects, which index() has no more.
    [[nodiscard]] std::vector<StoreObject> take_objects() { return std::move(index_.objects); }
    [[nodiscard]] Result<std::string> intrinsics(std::uint32_t object) const;
    [[nodiscard]] Result<std::string> pose(std::uint64_t row) const;
    /// uint8 [channels,S,S]. Errors: as RecordFile::read().
    Status image(Table map, std::uint64_t row, std::span<std::byte> to) const;

  private:
    Store() = default;
    Status read_objects(const std::string& folder);

    StoreIndex index_;
    std::vector<std::string> intrinsics_;  ///< from store.json; else they stay in the file
    std::unique_ptr<RecordFile> poses_, intrinsics_file_;
    std::map<Table, std::unique_ptr<RecordFile>> images_;
};

/// The part of a work that one of several processes does.
struct Part {
    std::uint32_t index = 0, count = 1;

    /// The first of `total` items of this part; that of the next part is its end.
    [[nodiscard]] std::uint64_t begin(std::uint64_t total) const {
        return total / count * index + std::min<std::uint64_t>(total % count, index);
    }
    [[nodiscard]] std::uint64_t end(std::uint64_t total) const {
        return Part{index + 1, count}.begin(total);
    }
};

/// Writes a store, in any order of rows. What a killed process left is continued. Several processes may write
/// different parts; rows of others are as they left them.
class StoreWriter : NoCopy {
  public:
    /// Take the folder: one that does not exist, is empty, or holds the same import, begun or complete.
    /// `replace`: another store in it is removed. Errors: kInvalidState if another process writes it, or this part;
    /// kInvalidArgument for a folder with anything else, or begun in another number of parts, and for names of
    /// objects that are not UTF-8; kUnsupported for more rows or objects than a store holds; as io::system_error().
    static Result<std::unique_ptr<StoreWriter>> open(const std::string& folder, StoreIndex index,
                                                     bool replace, Part part = {});

    /// The folder holds all of it, and nothing is left to write.
    [[nodiscard]] bool complete() const { return complete_; }
    [[nodiscard]] const StoreIndex& index() const { return index_; }

    /// `table` is kPoses or a map. Errors: kFormat for a pose of more than kMaxPoseBytes; as RecordFile::put().
    Status put(Table table, std::uint64_t row, io::Bytes bytes);
    /// The row was written before, and reads back with its checksum.
    [[nodiscard]] bool holds(Table table, std::uint64_t row) const;
    /// Some rows may be there.
    [[nodiscard]] bool is_begun() const { return begun_; }

    /// Write store.json once the disk has the rows of all parts; the last part to end does. Errors: as
    /// io::system_error().
    Status finish();

  private:
    StoreWriter(std::string folder, StoreIndex index, Part part)
        : folder_(std::move(folder)), index_(std::move(index)), part_(part) {}
    Status lock();
    Result<FileLock> lock_start() const;
    Status check(bool replace);
    Status read_journals();
    [[nodiscard]] Status claim() const;  ///< a journal of no tables
    [[nodiscard]] Journal journal_of(const Part& part) const;
    [[nodiscard]] bool is_done(const Part& part) const;
    Status open_records();
    [[nodiscard]] Status write_objects() const;

    std::string folder_;
    StoreIndex index_;
    Part part_;
    FileLock lock_, part_lock_;
    bool complete_ = false, begun_ = false;
    std::map<Table, std::unique_ptr<RecordFile>> records_;
};

}  // namespace splat::tables
