#pragma once

#include <string>

namespace vkrun {

/// Text of an SVG or HTML file: the characters that XML reserves are replaced.
std::string xml_escaped(const std::string& text);

/// A <text> element at (x, y) pixels; anchor: start, middle or end.
std::string svg_text(double x, double y, const char* anchor, const std::string& text);

}  // namespace vkrun
