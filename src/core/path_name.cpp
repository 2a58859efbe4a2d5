#include "core/path_name.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "core/hash.h"
#include "core/os/path.h"
#include "core/shown.h"

namespace splat {
namespace {

/// Bytes of the UTF-8 sequence at `at`; 0: there is none. Source: RFC 3629, section 4.
std::size_t sequence_at(const std::string& text, std::size_t at) {
    const auto byte = [&](std::size_t i) {
        return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0U;
    };
    const auto continues = [&](std::size_t i, unsigned least = 0x80, unsigned most = 0xBF) {
        return byte(i) >= least && byte(i) <= most;
    };
    const unsigned first = byte(0);
    if (first < 0x80) return 1;
    if (first >= 0xC2 && first <= 0xDF) return continues(1) ? 2 : 0;
    if (first >= 0xE0 && first <= 0xEF) {
        const bool second = continues(1, first == 0xE0 ? 0xA0 : 0x80, first == 0xED ? 0x9F : 0xBF);
        return second && continues(2) ? 3 : 0;
    }
    if (first < 0xF0 || first > 0xF4) return 0;
    const bool second = continues(1, first == 0xF0 ? 0x90 : 0x80, first == 0xF4 ? 0x8F : 0xBF);
    return second && continues(2) && continues(3) ? 4 : 0;
}

bool is_forbidden(char c) {
    const auto code = static_cast<unsigned char>(c);
    return code < 0x20 || code == 0x7F ||
           std::string_view("/\\:*?\"<>|%").find(c) != std::string_view::npos;
}

/// "C:x" is a path in the current folder of a drive.
bool has_drive(std::string_view part) {
    const auto lower = static_cast<unsigned char>(part.empty() ? 0 : part[0] | 0x20);
    return part.size() >= 2 && part[1] == ':' && lower >= 'a' && lower <= 'z';
}

std::string hash_of(const std::string& name) {
    Hash hash;
    hash.add(name);
    return "~" + hash.text();
}

}  // namespace

PathName::PathName(const std::string& name) {
    const bool is_device = os::is_device_name(name);
    std::vector<std::string> pieces;
    std::size_t total = 0;
    for (std::size_t at = 0; at < name.size();) {
        const std::size_t bytes = sequence_at(name, at);
        const char c = name[at];
        const bool first = at == 0, last = at + 1 == name.size();
        const bool hidden = (first && c == '.') || (last && (c == '.' || c == ' '));
        const bool encoded = bytes == 0 || is_forbidden(c) || hidden || (first && is_device);
        pieces.push_back(encoded ? format("%%%02X", static_cast<unsigned char>(c))
                                 : name.substr(at, bytes));
        total += pieces.back().size();
        at += std::max<std::size_t>(bytes, 1);
    }
    const std::string hash = total > kLongest ? hash_of(name) : "";
    for (const std::string& piece : pieces) {
        if (!hash.empty() && text_.size() + piece.size() + hash.size() > kLongest) break;
        text_ += piece;
    }
    text_ += hash;
    if (text_.empty()) text_ = "%";
}

bool is_name_in_folder(const std::string& name) {
    return !name.empty() && name.find_first_of({"/\\", 3}) == std::string::npos && name != "." &&
           name != ".." && !has_drive(name);
}

Status check_portable(const std::string& path) {
    bool portable = path.find_first_of({"\\", 2}) == std::string::npos && !path.starts_with("//");
    for (std::size_t at = 0; at < path.size(); at = std::min(path.find('/', at), path.size()) + 1)
        portable = portable && !has_drive(std::string_view(path).substr(at));
    if (portable) return {};
    return damaged(
        "the path '%s', expected one with '/' between folders and without a drive or a server, "
        "which "
        "every system reads alike; change it in the file that names it",
        shown(path).c_str());
}

Status check_below(const std::string& path) {
    SPLAT_TRY(check_portable(path));
    bool below = !path.empty() && !path.starts_with('/');
    for (std::size_t at = 0; at < path.size();) {
        const std::size_t end = std::min(path.find('/', at), path.size());
        below = below && path.substr(at, end - at) != "..";
        at = end + 1;
    }
    if (below) return {};
    return damaged("the path '%s', expected one below the folder of the data", shown(path).c_str());
}

}  // namespace splat
