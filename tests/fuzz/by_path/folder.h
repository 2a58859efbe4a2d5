#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/os/file.h"
#include "core/os/path.h"
#include "fuzz/target.h"

namespace splat::fuzz {

/// Files for readers that take paths: in memory where the system has /dev/shm, removed at the end.
class Folder {
  public:
    explicit Folder(const std::vector<std::string>& names) {
        namespace fs = std::filesystem;
        std::error_code failed;
        const bool has_memory = fs::exists("/dev/shm", failed);
        path_ = has_memory ? "/dev/shm" : os::temporary_place();
        path_ += "/splat_fuzz_XXXXXX";
        require(os::make_temporary_folder(path_) == 0);
        for (const std::string& name : names) {
            fs::create_directories(fs::path(path(name)).parent_path());
            files_.push_back(os::open(path(name), os::Open::kUpdate));
            require(files_.back() != os::kNoHandle);
        }
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() {
        for (const os::Handle file : files_) os::close(file);
        std::error_code failed;
        std::filesystem::remove_all(path_, failed);
    }

    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] std::string path(const std::string& name) const { return path_ + "/" + name; }

    /// Replaces the content of one of the files.
    void write(std::size_t index, io::Bytes bytes) const {
        require(os::write(files_[index], bytes.data(), bytes.size(), 0) ==
                static_cast<std::int64_t>(bytes.size()));
        require(os::resize(files_[index], bytes.size()) == 0);
    }

  private:
    std::string path_;
    std::vector<os::Handle> files_;
};

}  // namespace splat::fuzz
