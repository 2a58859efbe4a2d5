#include "io/scene_file.h"

#include <cctype>

#include "io/compress.h"
#include "io/file.h"
#include "io/ply.h"
#include "io/ply_compressed.h"
#include "io/splat_file.h"
#include "io/spz.h"

namespace splat::io {
namespace {

/// In lower case, without the point.
std::string extension_of(const std::string& name) {
    const std::size_t dot = name.find_last_of("./");
    if (dot == std::string::npos || name[dot] == '/') return "";
    std::string extension = name.substr(dot + 1);
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

Status unsupported(const std::string& name, const char* format) {
    return error(Code::kUnsupported,
                 "'%s' is a %s file, which is not read; convert it to .ply, .splat or .spz",
                 name.c_str(), format);
}

Status with_name(const Status& status, const std::string& name) {
    return {status.code(), "'" + name + "': " + status.message()};
}

Result<LoadedScene> read_as(SceneFormat format, Bytes file, const LoadOptions& options) {
    switch (format) {
        case SceneFormat::kPly:
            return read_ply(file, options);
        case SceneFormat::kCompressedPly:
            return read_compressed_ply(file, options);
        case SceneFormat::kSplat:
            return read_splat(file, options);
        case SceneFormat::kSpz:
            return read_spz(file, options);
    }
    return error(Code::kInternal, "scene format %d", static_cast<int>(format));
}

const char* format_name(SceneFormat format) {
    constexpr const char* kNames[] = {"ply", "compressed ply", "splat", "spz"};
    return kNames[static_cast<std::size_t>(format)];
}

/// The format that the first bytes say, if they say one that is read.
std::optional<SceneFormat> marked_format(Bytes file) {
    const auto found = detect_scene_format(file, "");
    return found.ok() ? std::optional(found.value()) : std::nullopt;
}

}  // namespace

Result<SceneFormat> detect_scene_format(Bytes file, const std::string& name) {
    const std::string_view text = as_text(file);
    if (is_ply(file)) {
        const auto header = parse_ply_header(file);
        if (!header.ok()) return with_name(header.status(), name);
        return is_compressed_ply(header.value()) ? SceneFormat::kCompressedPly : SceneFormat::kPly;
    }
    if (is_gzip(file) || text.starts_with("NGSP")) return SceneFormat::kSpz;
    if (text.starts_with("glTF")) return unsupported(name, "glTF binary");
    if (text.starts_with("PK\x03\x04")) return unsupported(name, "zip (SOG)");
    const std::string extension = extension_of(name);
    if (extension == "splat") return SceneFormat::kSplat;
    if (extension == "ksplat") return unsupported(name, ".ksplat");
    if (extension == "ply" || extension == "spz")
        return error(Code::kInvalidArgument,
                     "'%s' is no .%s file: its first bytes are others; expected %s", name.c_str(),
                     extension.c_str(), extension == "ply" ? "the line 'ply'" : "gzip or 'NGSP'");
    return error(
        Code::kInvalidArgument,
        "'%s' is no scene that is read here: .ply (3DGS, plain or compressed), .splat, .spz",
        name.c_str());
}

Result<LoadedScene> read_scene(Bytes file, const std::string& name, const LoadOptions& options) {
    SPLAT_ASSIGN(const SceneFormat format, detect_scene_format(file, name));
    return read_scene_as(format, file, name, options);
}

Result<LoadedScene> read_scene_as(SceneFormat format, Bytes file, const std::string& name,
                                  const LoadOptions& options) {
    // Any bytes may begin a .splat file, those of another format's mark too.
    if (format != SceneFormat::kSplat)
        if (const auto marked = marked_format(file); marked && *marked != format)
            return error(Code::kInvalidArgument, "'%s' is of the format %s, expected %s",
                         name.c_str(), format_name(*marked), format_name(format));
    auto loaded = read_as(format, file, options);
    if (!loaded.ok()) return with_name(loaded.status(), name);
    return loaded;
}

Result<LoadedScene> load_scene(const std::string& path, const LoadOptions& options) {
    SPLAT_ASSIGN(const Buffer file, read_file(path));
    return read_scene(file, path, options);
}

Result<Buffer> write_scene(const scene::Gaussians& gaussians, const std::string& name,
                           const SaveOptions& options) {
    const std::string extension = extension_of(name);
    if (extension == "ply") return write_ply(gaussians, options);
    if (extension == "splat") return write_splat(gaussians, options);
    if (extension == "spz") return write_spz(gaussians, options);
    return error(Code::kUnsupported, "'%s': extension '%s', expected .ply, .splat or .spz",
                 name.c_str(), extension.c_str());
}

Status save_scene(const scene::Gaussians& gaussians, const std::string& path,
                  const SaveOptions& options) {
    SPLAT_ASSIGN(const Buffer file, write_scene(gaussians, path, options));
    return write_file(path, file);
}

}  // namespace splat::io
