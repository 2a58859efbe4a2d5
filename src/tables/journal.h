#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/status.h"

namespace splat::tables {

/// What a work that can go on has begun in a folder, as a JSON file: import.json of a store, export_<split>.json of
/// an export, which stays. The file is replaced whole.
class Journal {
  public:
    struct File {
        std::string path;  ///< in the folder
        std::uint64_t bytes = 0;
        std::uint32_t crc = 0;
    };

    /// A work that is not begun.
    Journal(std::string folder, const std::string& name, std::string source)
        : folder_(std::move(folder)), path_(folder_ + "/" + name), source_(std::move(source)) {}

    /// Nothing if the file is missing or damaged.
    static std::optional<Journal> read(const std::string& folder, const std::string& name);

    /// export_<split>.json, begun or there. `targets`: folders that the export makes. Errors: kInvalidArgument if the
    /// folder holds another export of the split, or one of the targets although it holds no export.
    static Result<Journal> of_export(const std::string& folder, const std::string& split,
                                     const std::string& source,
                                     const std::vector<std::string>& targets);

    /// Every file that export_<split>.json of a folder lists is unchanged; true without such a list. Errors: kFormat,
    /// naming the file.
    static Status verify(const std::string& folder, const std::string& split);

    [[nodiscard]] const std::string& source() const { return source_; }  ///< equal: equal contents
    [[nodiscard]] bool is_done() const { return done_; }

    /// Note that the work has begun, or that all of it is done. Errors: kIo.
    Status write(bool done);

    /// The file was written whole, and is unchanged.
    [[nodiscard]] bool holds(const std::string& path) const;

    /// Note a complete file, with its checksum. Errors: kIo.
    Status add(const std::string& path);

  private:
    std::string folder_, path_, source_;
    bool done_ = false;
    std::vector<File> files_;
};

}  // namespace splat::tables
