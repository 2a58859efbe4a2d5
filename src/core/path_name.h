#pragma once

#include <filesystem>
#include <string>

#include "core/status.h"

namespace splat {

/// A name that came with data, as one part of a path. Whatever is written below a folder takes this type, so that no
/// name leads elsewhere.
///
/// %XX stands for what some system forbids (control characters and / \ : * ? " < > |), for %, for bytes that are not
/// UTF-8, a dot at the start, and a dot or blank at the end: different names stay different. A name of more than
/// kLongest bytes is cut and ends with '~' and the 16 digits of its hash (FNV-1a). An empty one is "%".
class PathName {
  public:
    static constexpr std::size_t kLongest = 200;  ///< leaves room for an extension and a number

    explicit PathName(const std::string& name);
    [[nodiscard]] const std::string& text() const { return text_; }

  private:
    std::string text_;
};

inline std::filesystem::path operator/(const std::filesystem::path& folder, const PathName& name) {
    return folder / name.text();
}

/// Checks a path that came with data and is to lie in a folder: relative, without "..". Errors: kFormat.
Status check_below(const std::string& path);

}  // namespace splat
