#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/decode_budget.h"
#include "tables/store.h"
#include "tables/table_reader.h"

namespace splat::tables {

/// The place of each (uuid, frame) of a split: rows are ordered by uuid, then by frame.
class TableKeys {
  public:
    /// Read the ids of all tables, in the order of kTables. Errors: kFormat, with table, file and row: an id that
    /// occurs twice, or is missing in one of the tables, and more of them than the budget of the files allows.
    Status read(const std::vector<TableReader>& tables, DecodeBudget& budget);

    [[nodiscard]] std::vector<StoreObject> objects() const { return objects_; }
    [[nodiscard]] std::vector<std::int64_t> frames() const;
    [[nodiscard]] std::uint64_t rows() const { return keys_.size(); }

    /// The place of a row. Errors: kFormat if its id is in no other table.
    [[nodiscard]] Result<std::uint64_t> place_of(const TableRow& row) const;

  private:
    Status read_objects(const TableReader& intrinsics, DecodeBudget& budget);
    Status read_poses(const TableReader& poses, DecodeBudget& budget);
    Status compare(const TableReader& table) const;
    [[nodiscard]] Result<std::uint64_t> key_of(const TableRow& row) const;
    [[nodiscard]] std::string name_of(std::uint64_t key) const;

    std::vector<StoreObject> objects_;
    std::map<std::string, std::uint32_t, std::less<>> numbers_;  ///< numbers of the objects
    std::vector<std::uint64_t> keys_;  ///< object * 2^32 + frame, ascending
};

}  // namespace splat::tables
