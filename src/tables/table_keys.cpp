#include "tables/table_keys.h"

#include <algorithm>

#include "tables/srn_text.h"

namespace splat::tables {
namespace {

constexpr unsigned kFrameBits = 32;
constexpr std::uint64_t kRowBytes = 32;      ///< in memory, with what a growing array copies
constexpr std::uint64_t kObjectBytes = 512;  ///< besides its texts

}  // namespace

std::string TableKeys::name_of(std::uint64_t key) const {
    return format("uuid '%s', frame %llu", objects_[key >> kFrameBits].name.c_str(),
                  llu(key & 0xFFFFFFFFU));
}

std::vector<std::int64_t> TableKeys::frames() const {
    std::vector<std::int64_t> frames;
    for (const std::uint64_t key : keys_)
        frames.push_back(static_cast<std::int64_t>(key & 0xFFFFFFFFU));
    return frames;
}

Result<std::uint64_t> TableKeys::key_of(const TableRow& row) const {
    const auto found = numbers_.find(row.uuid);
    if (found == numbers_.end())
        return damaged("uuid '%.*s' is not in the table %s",
                       static_cast<int>(std::min<std::size_t>(row.uuid.size(), 128)),
                       row.uuid.data(), kind_of(Table::kIntrinsics).name);
    return (std::uint64_t{found->second} << kFrameBits) | static_cast<std::uint64_t>(row.frame);
}

Result<std::uint64_t> TableKeys::place_of(const TableRow& row) const {
    SPLAT_ASSIGN(const std::uint64_t key, key_of(row));
    const auto found = std::ranges::lower_bound(keys_, key);
    if (found == keys_.end() || *found != key)
        return damaged("%s is not in the table %s", name_of(key).c_str(),
                       kind_of(Table::kPoses).name);
    return static_cast<std::uint64_t>(found - keys_.begin());
}

Status TableKeys::read(const std::vector<TableReader>& tables, DecodeBudget& budget) {
    for (const TableReader& table : tables) {
        if (table.table() == Table::kIntrinsics)
            SPLAT_TRY(read_objects(table, budget));
        else if (table.table() == Table::kPoses)
            SPLAT_TRY(read_poses(table, budget));
        else
            SPLAT_TRY(compare(table));
    }
    return {};
}

Status TableKeys::read_objects(const TableReader& intrinsics, DecodeBudget& budget) {
    std::map<std::string, std::string, std::less<>> texts;
    for (std::size_t file = 0; file < intrinsics.files().size(); ++file)
        SPLAT_TRY(intrinsics.values(
            file, 0, intrinsics.rows(file), kMaxIntrinsicsBytes,
            [&](const TableRow& row) -> Status {
                Status status = focal_of(row.value).status();
                if (status.ok() && row.uuid.empty()) status = damaged("the uuid is empty");
                if (status.ok())
                    status = budget.take(kObjectBytes + 4 * (row.uuid.size() + row.value.size()), 1,
                                         "objects");
                if (status.ok() && !texts.emplace(row.uuid, row.value).second)
                    status = damaged("uuid '%s' occurs twice", std::string(row.uuid).c_str());
                return status.ok() ? status : intrinsics.in_row(file, row.number, status);
            }));
    if (texts.empty())
        return not_found("table %s, '%s': no rows of this split", kind_of(Table::kIntrinsics).name,
                         intrinsics.files().front().c_str());
    for (const auto& [name, text] : texts) {
        numbers_[name] = static_cast<std::uint32_t>(objects_.size());
        objects_.push_back({name, text, 0});
    }
    return {};
}

Status TableKeys::read_poses(const TableReader& poses, DecodeBudget& budget) {
    for (std::size_t file = 0; file < poses.files().size(); ++file)
        SPLAT_TRY(poses.keys(file, [&](const TableRow& row) -> Status {
            const auto key = key_of(row);
            if (!key.ok()) return poses.in_row(file, row.number, key.status());
            if (keys_.size() == kMaxRows)
                return unsupported("more than %llu rows in a split", llu(kMaxRows));
            const Status kept = budget.take(kRowBytes, 1, "rows");
            if (!kept.ok()) return poses.in_row(file, row.number, kept);
            keys_.push_back(key.value());
            ++objects_[key.value() >> kFrameBits].views;
            return {};
        }));
    std::ranges::sort(keys_);
    const auto twice = std::ranges::adjacent_find(keys_);
    if (twice != keys_.end())
        return damaged("table %s: %s occurs twice", kind_of(Table::kPoses).name,
                       name_of(*twice).c_str());
    for (const StoreObject& object : objects_)
        if (object.views == 0)
            return damaged("table %s: uuid '%s' of the table %s has no rows",
                           kind_of(Table::kPoses).name, object.name.c_str(),
                           kind_of(Table::kIntrinsics).name);
    return {};
}

Status TableKeys::compare(const TableReader& table) const {
    std::vector<bool> seen(keys_.size());
    std::uint64_t rows = 0;
    for (std::size_t file = 0; file < table.files().size(); ++file)
        SPLAT_TRY(table.keys(file, [&](const TableRow& row) -> Status {
            const auto place = place_of(row);
            if (!place.ok()) return table.in_row(file, row.number, place.status());
            if (seen[place.value()])
                return table.in_row(
                    file, row.number,
                    damaged("%s occurs twice", name_of(keys_[place.value()]).c_str()));
            seen[place.value()] = true;
            ++rows;
            return {};
        }));
    if (rows == keys_.size()) return {};
    const auto missing = std::ranges::find(seen, false) - seen.begin();
    return damaged("table %s: %llu rows, but %s has %zu; the first missing: %s",
                   kind_of(table.table()).name, llu(rows), kind_of(Table::kPoses).name,
                   keys_.size(), name_of(keys_[static_cast<std::size_t>(missing)]).c_str());
}

}  // namespace splat::tables
