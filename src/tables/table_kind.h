#pragma once

#include <cstdint>

namespace splat::tables {

/// What a table holds; the order in which they are read and written.
enum class Table : std::uint8_t { kIntrinsics, kPoses, kRgb, kDepth, kNormal, kMask };
inline constexpr Table kTables[] = {Table::kIntrinsics, Table::kPoses,  Table::kRgb,
                                    Table::kDepth,      Table::kNormal, Table::kMask};

struct TableKind {
    const char* name;        ///< name of the folder, and the end of the file's name
    const char* column;      ///< column of the values
    const char* map;         ///< name of the images in SRN's folders and in a store; null: text
    std::uint32_t channels;  ///< channels of an image: uint8 [channels,S,S]
    bool required;
};

/// The kinds of the published tables.
constexpr TableKind kind_of(Table table) {
    constexpr TableKind kKinds[] = {{"intrins", "intrinsics", nullptr, 0, true},
                                    {"poses", "pose", nullptr, 0, true},
                                    {"rgbs", "rgb", "rgb", 3, true},
                                    {"depths", "depth", "depth", 1, false},
                                    {"normals", "normal", "normal", 3, false},
                                    {"segmentation", "segmentation", "mask", 1, false}};
    return kKinds[static_cast<std::uint8_t>(table)];
}

inline constexpr const char* kSplits[] = {"train", "val", "test"};

}  // namespace splat::tables
