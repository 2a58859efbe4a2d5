#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "core/status.h"

namespace splat::tables {

/// A lock of a file that the process keeps until its end; by default none.
class FileLock {
  public:
    enum class Kind {
        kAlone,   ///< fails if another process has it
        kShared,  ///< with others of this kind; fails if one has it alone
        kWait     ///< alone, after the others
    };

    /// The file is created where it is missing. Errors: kInvalidState if another process has it, with a sentence on
    /// `what` is in use; as io::system_error().
    static Result<FileLock> take(const std::string& path, Kind kind, const std::string& what);

    FileLock() = default;
    FileLock(FileLock&& other) noexcept
        : file_(std::exchange(other.file_, -1)), generation_(other.generation_) {}
    FileLock& operator=(FileLock&& other) noexcept {
        std::swap(file_, other.file_);
        std::swap(generation_, other.generation_);
        return *this;
    }
    FileLock(const FileLock&) = delete;
    FileLock& operator=(const FileLock&) = delete;
    ~FileLock();

  private:
    int file_ = -1;
    std::uint32_t generation_ = 0;  ///< fork_generation() of the process that locked it
};

}  // namespace splat::tables
