#pragma once

#include <string>
#include <vector>

namespace vkrun {

/// Rows of text in aligned columns, the first row being the heading.
class Table {
  public:
    /// A heading that starts with '>' makes its column flush right.
    explicit Table(std::vector<std::string> headings);
    void add(std::vector<std::string> cells);
    [[nodiscard]] std::string text() const;

  private:
    std::vector<bool> right_;
    std::vector<std::vector<std::string>> rows_;
};

}  // namespace vkrun
