#include "vkrun/svg.h"

#include "vkrun/table.h"

namespace vkrun {

std::string svg_escaped(const std::string& text) {
    std::string out;
    for (const char c : text)
        out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : c == '>' ? "&gt;" : std::string(1, c);
    return out;
}

std::string svg_text(double x, double y, const char* anchor, const std::string& text) {
    return format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y, anchor) +
           svg_escaped(text) + "</text>\n";
}

}  // namespace vkrun
