#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/status.h"
#include "io/image.h"

namespace splat::test {

/// An SQL blob of an image as a PNG file.
std::string png_literal(const io::Image& image);

/// A small set of tables, written by DuckDB's own SQL in the published schema: objects "a" and "b" of 3 views of
/// 4 x 4 pixels; row i of each table is view i % 3 of object i / 3, and rows are in falling order. A sample of image
/// of row i is 'a' + i in rgb, 'A' + i in depth, '0' + i in normal.
class PublishedTables {
  public:
    PublishedTables();

    /// SELECT of each table; "poses" for example.
    std::map<std::string, std::string> selects;

    /// Write <table>/train/<table>.parquet of each.
    Status write(const std::filesystem::path& folder, const std::string& options = "") const;

    /// Write srn_cars_<table>.parquet of each, with the column split: the rows of the split, and others of "test".
    Status write_with_split(const std::filesystem::path& folder) const;
};

}  // namespace splat::test
