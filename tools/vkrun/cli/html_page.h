#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace vkrun {

/// A self-contained HTML page: headings, tables, pictures and curves. It loads nothing from elsewhere.
class HtmlPage {
  public:
    explicit HtmlPage(const std::string& title);

    void heading(const std::string& text);
    void paragraph(const std::string& text);
    void facts(const std::vector<std::pair<std::string, std::string>>& rows);

    /// The first row is the heading; a column whose heading starts with '>' is flush right.
    void table(const std::vector<std::vector<std::string>>& rows);

    /// Embed a PNG or GIF file, shown `width` pixels of the page wide (0: its own size); nothing if it
    /// cannot be read.
    void picture(const std::string& path, const std::string& caption, std::uint32_t width = 0);

    /// Show an SVG file.
    void plot(const std::string& svg, const std::string& caption);

    struct Curve {
        std::string name;
        std::vector<std::pair<double, double>> points;
    };
    void chart(const std::string& caption, const std::vector<Curve>& curves);

    [[nodiscard]] std::string text() const;

  private:
    std::string body_;
    std::string title_;
};

}  // namespace vkrun
