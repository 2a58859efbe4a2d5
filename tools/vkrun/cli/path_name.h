#pragma once

#include <string>

namespace vkrun {

/// A name of data as one part of a path, by splat_path_name(): files named after objects and views take it.
class PathName {
  public:
    explicit PathName(const std::string& name);
    [[nodiscard]] const std::string& text() const { return text_; }

  private:
    std::string text_;
};

}  // namespace vkrun
