#pragma once

#include "data/dataset_export.h"
#include "io/bytes.h"
#include "tables/journal.h"
#include "tables/table_kind.h"

namespace splat::data {

/// The rows of an export, of all its tables.
class ExportRows {
  public:
    ExportRows(Dataset& dataset, const ExportDesc& desc, const tables::Progress& progress);

    [[nodiscard]] const std::vector<std::uint32_t>& objects() const { return objects_; }
    [[nodiscard]] std::uint64_t rows() const { return rows_; }
    [[nodiscard]] std::vector<tables::Table> maps() const;
    [[nodiscard]] const std::string& name(std::uint32_t object) const;
    [[nodiscard]] Dataset& dataset() { return dataset_; }

    /// What tells exports apart, as text: format, category, objects, sizes, maps, background; names, sizes and times
    /// of the objects' files, without those below `out`. Errors: those of progress.
    [[nodiscard]] Result<std::string> source(const std::string& out);

    /// The cameras of an object with the numbers of its views; where their names are no numbers, they are counted,
    /// with one warning. Errors: as DatasetReader::text().
    struct Cameras {
        ObjectText text;
        std::vector<std::int64_t> frames;
    };
    Result<Cameras> cameras(std::uint32_t object);

    /// uint8 [channels,R,R] of an image. Errors: as Dataset::read().
    Result<io::Buffer> planes(std::uint32_t object, std::uint32_t view, tables::Table map);

    /// Count rows of one table as done. Errors: those of progress.
    Status advance(std::uint64_t rows);

  private:
    Dataset& dataset_;
    const tables::Progress& progress_;
    std::string category_;
    std::vector<std::uint32_t> objects_;
    std::uint64_t rows_ = 0, done_ = 0;
    bool warned_ = false;
};

Status export_tables(ExportRows& rows, const ExportDesc& desc);
Status export_srn(ExportRows& rows, const ExportDesc& desc);
Status export_images(ExportRows& rows, const ExportDesc& desc);
Status export_store(ExportRows& rows, const ExportDesc& desc);

}  // namespace splat::data
