#include "vkrun/cli/svg.h"

#include "vkrun/cli/text.h"

namespace vkrun {

std::string xml_escaped(const std::string& text) {
    std::string out;
    for (const char c : text)
        out += c == '&'   ? "&amp;"
               : c == '<' ? "&lt;"
               : c == '>' ? "&gt;"
               : c == '"' ? "&quot;"
                          : std::string(1, c);
    return out;
}

std::string svg_text(double x, double y, const char* anchor, const std::string& text) {
    return format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y, anchor) +
           xml_escaped(text) + "</text>\n";
}

}  // namespace vkrun
