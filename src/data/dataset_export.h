#pragma once

#include "data/dataset.h"
#include "tables/import.h"

namespace splat::data {

/// How a data set is written:
///   kTables   <table>/<split>/*.parquet in the published schema, with README.md
///   kSrn      srn_<category>/<category>_<split>/<object>/ with intrinsics.txt, pose/, rgb/, depth/, normal/, mask/
///   kImages   <split>/<object>/ with transforms.json, rgb/, depth/, normal/, mask/
///   kStore    <split>/, a store (src/tables/store.h)
enum class Layout { kTables, kSrn, kImages, kStore };

struct ExportDesc {
    std::string path;
    Layout layout = Layout::kTables;
    std::string split;                   ///< to write; empty: that of the data set
    std::string category = "cars";       ///< in names of folders and configurations
    std::vector<std::uint32_t> objects;  ///< numbers in the data set; empty: all
    std::string library;                 ///< DuckDB, see tables::duckdb_library()
    tables::Part part = {};              ///< part of a store: the objects that are written
};

/// Write objects with their cameras, images and all maps that the data set has, as uint8 at its resolution. What
/// a killed process left is continued: by file, object, or row group. A file export_<split>.json in the folder
/// says what it holds; it lists the files of tables with their CRC-32.
///
/// Errors   kInvalidArgument for the desc, and for a folder with another export of the split; kUnsupported for
///          cameras that SRN's files cannot hold; kIo; those of Dataset::read() and `progress`
Status export_dataset(Dataset& dataset, const ExportDesc& desc, const tables::Progress& progress);

}  // namespace splat::data
