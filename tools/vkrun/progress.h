#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace vkrun {

/// A bar on standard error with the rate and the time that is left; nothing where that is no
/// terminal.
class Progress {
  public:
    Progress(std::string what, std::size_t total);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void show(std::size_t done);

  private:
    std::string what_;
    std::size_t total_;
    bool terminal_;
    bool shown_ = false;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace vkrun
