#pragma once

#include <string>
#include <vector>

namespace vkrun {

/// printf into a string.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

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

/// "3.8 GiB"
std::string bytes_text(unsigned long long bytes);

}  // namespace vkrun
