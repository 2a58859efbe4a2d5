#pragma once

#include <filesystem>
#include <string>

namespace vkrun {

/// A folder that is removed with the object.
class TemporaryFolder {
  public:
    /// Throws a Failure.
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    [[nodiscard]] std::string file(const char* name) const { return (path_ / name).string(); }
    [[nodiscard]] std::string path() const { return path_.string(); }

  private:
    std::filesystem::path path_;
    int lock_ = -1;
};

}  // namespace vkrun
