#pragma once

#include <cstddef>
#include <string>

#include "vkrun/cli/stopwatch.h"

namespace vkrun {

/// A bar on standard error with the remaining time; nothing unless that is a terminal.
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
    Stopwatch watch_;
};

}  // namespace vkrun
