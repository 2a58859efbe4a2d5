#pragma once

#include <string>

#include "tables/store.h"

namespace splat::tables {

/// store.json, without the frames. Errors: kUnsupported if the objects need more than JSON's limit;
/// kInvalidArgument for names that are not UTF-8.
Result<std::string> store_text(const StoreIndex& index);

/// The same read back; frames are as many zeros as there are rows. Errors: kFormat, kUnsupported.
Result<StoreIndex> read_store_text(const std::string& folder);

/// True if store.json is that of a store, of any version and perhaps damaged, and not another program's.
bool is_store_text(const std::string& folder);

RecordShape frame_shape(std::uint64_t rows);
RecordShape pose_shape(std::uint64_t rows);
RecordShape image_shape(const StoreIndex& index, Table map);

}  // namespace splat::tables
