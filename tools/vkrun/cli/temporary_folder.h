#pragma once

#include <string>

#include "core/os/file.h"

namespace vkrun {

/// A folder that is removed with the object.
class TemporaryFolder {
  public:
    /// Throws a Failure.
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    [[nodiscard]] std::string file(const char* name) const { return path_ + "/" + name; }
    [[nodiscard]] const std::string& path() const { return path_; }

  private:
    std::string path_;
    splat::os::Handle lock_ = splat::os::kNoHandle;
    bool removed_by_interrupt_ = false;
};

}  // namespace vkrun
