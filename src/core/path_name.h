#pragma once

#include <filesystem>
#include <string>

#include "core/os/path.h"
#include "core/status.h"

namespace splat {

/// A name that came with data, as one part of a path. Whatever is written below a folder takes this type, so that no
/// name leads elsewhere.
///
/// %XX stands for what some system forbids (control characters and / \ : * ? " < > |), for %, for bytes that are not
/// UTF-8, a dot at the start, a dot or blank at the end, and the first letter of a name that is a device on Windows
/// (NUL, con.png): different names stay different. A name of more than kLongest bytes is cut and ends with '~' and the
/// 16 digits of its hash (FNV-1a). An empty one is "%".
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

/// True for a name that came with data and is that of a file or folder in a folder, on every system: without '/', '\\'
/// and NUL, no "." or "..", and without a letter and ':' at its start, a drive. Names that only some systems have, such
/// as "aux", are read where they are.
bool is_name_in_folder(const std::string& name);

/// Checks a path that came with data, to be read, which every system must take alike: '/' is between its folders, and
/// it begins with no drive and no server ("//host"). Errors: kFormat.
Status check_portable(const std::string& path);

/// The same for a path that is to lie in a folder: relative, without "..". Errors: kFormat.
Status check_below(const std::string& path);

}  // namespace splat
