#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/status.h"

namespace splat::tables {

/// What export_<split>.json says: the rows are those of `source`, and files are complete.
class ExportJournal {
  public:
    struct File {
        std::string path;  ///< in the folder
        std::uint64_t bytes = 0;
        std::uint32_t crc = 0;
    };

    /// `targets`: folders that the export makes. Errors: kInvalidArgument if the folder holds another export of the
    /// split, or one of the targets although it holds no export.
    static Result<ExportJournal> open(const std::string& folder, const std::string& split,
                                      const std::string& source,
                                      const std::vector<std::string>& targets);

    /// The file was written whole, and is unchanged.
    [[nodiscard]] bool holds(const std::string& path) const;

    /// Every file that export_<split>.json of a folder lists is unchanged; true without such a list. Errors: kFormat,
    /// naming the file.
    static Status verify(const std::string& folder, const std::string& split);

    /// Note a complete file, with its checksum. Errors: kIo.
    Status add(const std::string& path);

  private:
    ExportJournal(std::string folder, std::string file, std::string source)
        : folder_(std::move(folder)), file_(std::move(file)), source_(std::move(source)) {}
    [[nodiscard]] Status save() const;
    /// False if it cannot be read.
    bool load();

    std::string folder_, file_, source_;
    std::vector<File> files_;
};

}  // namespace splat::tables
