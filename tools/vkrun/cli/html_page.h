#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace vkrun {

/// A self-contained HTML page, light or dark as the reader prefers: headings, tables, pictures, curves and
/// scenes. It loads nothing from elsewhere.
class HtmlPage {
  public:
    explicit HtmlPage(const std::string& title);

    void heading(const std::string& text);
    void paragraph(const std::string& text);
    /// What the reader must know about all of the page.
    void note(const std::string& text);
    void facts(const std::vector<std::pair<std::string, std::string>>& rows);

    /// The first row is the heading; a column whose heading starts with '>' is flush right.
    void table(const std::vector<std::vector<std::string>>& rows);

    /// Embed a PNG or GIF file, shown `width` pixels of the page wide (0: its own size; from 600 on it
    /// takes the room that there is, and scrolls on narrow screens); nothing if it cannot be read.
    void picture(const std::string& path, const std::string& caption, std::uint32_t width = 0);

    /// Show an SVG file, with a link that saves it; charts have one, too.
    void plot(const std::string& svg, const std::string& caption);

    struct Curve {
        std::string name;
        std::vector<std::pair<double, double>> points;
    };
    void chart(const std::string& caption, const std::vector<Curve>& curves);

    /// Markup that needs a style and a script; the page gets either once.
    void embed(const std::string& markup, const std::string& style, const std::string& script);

    /// Load the page again every so many seconds.
    void reload(std::uint32_t seconds) { reload_ = seconds; }

    [[nodiscard]] std::string text() const;

  private:
    /// A link that saves a figure, named after its place in the page and its caption.
    std::string save_link(const std::string& svg, const std::string& caption);

    std::uint32_t figures_ = 0;
    std::string body_;
    std::string title_;
    std::string style_, script_;  ///< set by embed()
    std::uint32_t reload_ = 0;
};

/// An <img> with a PNG, GIF or WebP file; empty if it cannot be read.
std::string image_tag(const std::string& path, const std::string& text, std::uint32_t width = 0);

std::string base64(const std::string& bytes);

}  // namespace vkrun
