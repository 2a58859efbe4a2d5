#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "fuzz/target.h"

namespace splat::fuzz {

/// Files for readers that take paths: in memory where the system has /dev/shm, removed at the end.
class Folder {
  public:
    explicit Folder(const std::vector<std::string>& names) {
        namespace fs = std::filesystem;
        std::string folder = fs::exists("/dev/shm") ? "/dev/shm" : fs::temp_directory_path();
        folder += "/splat_fuzz_XXXXXX";
        require(::mkdtemp(folder.data()) != nullptr);
        path_ = folder;
        for (const std::string& name : names) {
            fs::create_directories(fs::path(path(name)).parent_path());
            files_.push_back(::open(path(name).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
            require(files_.back() >= 0);
        }
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() {
        for (const int file : files_) ::close(file);
        std::error_code failed;
        std::filesystem::remove_all(path_, failed);
    }

    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] std::string path(const std::string& name) const { return path_ + "/" + name; }

    /// Replaces the content of one of the files.
    void write(std::size_t index, io::Bytes bytes) const {
        require(::pwrite(files_[index], bytes.data(), bytes.size(), 0) ==
                static_cast<ssize_t>(bytes.size()));
        require(::ftruncate(files_[index], static_cast<off_t>(bytes.size())) == 0);
    }

  private:
    std::string path_;
    std::vector<int> files_;
};

}  // namespace splat::fuzz
