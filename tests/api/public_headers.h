#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace splat::test {

/// The text of all public headers.
inline std::string public_headers() {
    std::string text;
    for (const auto& entry : std::filesystem::directory_iterator(SPLAT_HEADERS)) {
        std::ifstream file(entry.path());
        text.append(std::istreambuf_iterator<char>(file), {});
    }
    return text;
}

}  // namespace splat::test
