#include "io/scene_file.h"

#include <algorithm>

#include "core/fork.h"
#include "io/compress.h"
#include "io/file.h"
#include "io/reader.h"
#include "io/scene_formats.h"

namespace splat::io {
namespace {

/// Formats that are known by their mark or extension, but not read.
struct UnreadFormat {
    const char* name;
    std::string_view mark;
    std::string_view extension;
};
constexpr UnreadFormat kUnread[] = {
    {"glTF binary", "glTF", ""}, {"zip (SOG)", "PK\x03\x04", ""}, {".ksplat", "", ".ksplat"}};

/// ".ply, .splat or .spz": extensions of all formats that are read, or of those that are written.
std::string extension_list(bool written) {
    std::vector<std::string> extensions;
    for (const SceneFormat& format : scene_formats())
        if ((!written || format.write != nullptr) &&
            std::ranges::find(extensions, format.extension) == extensions.end())
            extensions.emplace_back(format.extension);
    std::string list;
    for (std::size_t i = 0; i < extensions.size(); ++i)
        list += (i == 0 ? "" : i + 1 == extensions.size() ? " or " : ", ") + extensions[i];
    return list;
}

Status unread(const std::string& name, const UnreadFormat& format) {
    return unsupported("'%s' is a %s file, which is not read; convert it to %s", name.c_str(),
                       format.name, extension_list(true).c_str());
}

/// The rows by their ids, which are their places, counted from 1.
struct OrderedFormats {
    OrderedFormats() {
        for (const SceneFormat* row : scene_format_rows()) rows.push_back(*row);
        std::ranges::sort(rows, {}, &SceneFormat::id);
    }
    std::vector<SceneFormat> rows;
};

/// The format whose mark the file starts with; null for none. Errors: see SceneFormat::detect.
Result<const SceneFormat*> marked_format(Bytes file) {
    for (const SceneFormat& format : scene_formats()) {
        if (format.detect == nullptr) continue;
        SPLAT_ASSIGN(const bool found, format.detect(file));
        if (found) return &format;
    }
    return nullptr;
}

}  // namespace

std::span<const SceneFormat> scene_formats() {
    return for_ever<OrderedFormats>().rows;
}

Result<const SceneFormat*> detect_scene_format(Bytes file, const std::string& name) {
    const auto marked = marked_format(file);
    if (!marked.ok()) return in_file(marked.status(), name);
    if (marked.value() != nullptr) return marked.value();
    const std::string extension = extension_of(name);
    for (const UnreadFormat& format : kUnread)
        if (format.mark.empty() ? extension == format.extension
                                : as_text(file).starts_with(format.mark))
            return unread(name, format);
    for (const SceneFormat& format : scene_formats()) {
        if (extension != format.extension) continue;
        if (format.detect == nullptr) return &format;
        return damaged("'%s' is not a %s file: its first bytes differ; expected %s", name.c_str(),
                       format.extension, format.mark);
    }
    return damaged("'%s' is not a scene of a known format; expected %s", name.c_str(),
                   extension_list(false).c_str());
}

Result<const SceneFormat*> written_scene_format(const std::string& name) {
    const std::string extension = extension_of(name);
    for (const SceneFormat& format : scene_formats())
        if (format.write != nullptr && extension == format.extension) return &format;
    return unsupported("'%s': extension '%s', expected %s", name.c_str(), extension.c_str(),
                       extension_list(true).c_str());
}

Result<LoadedScene> read_scene(Bytes file, const std::string& name, const LoadOptions& options,
                               const SceneFormat* format) {
    if (format == nullptr) {
        SPLAT_ASSIGN(format, detect_scene_format(file, name));
    } else if (format->detect != nullptr) {
        // A format without a mark may begin with any bytes, another one's mark included.
        const auto marked = marked_format(file);
        if (marked.ok() && marked.value() != nullptr && marked.value() != format)
            return damaged("'%s' is of the format %s, expected %s", name.c_str(),
                           marked.value()->name, format->name);
    }
    SPLAT_ASSIGN(LoadedScene loaded, in_file(format->read(file, options), name));
    loaded.report.format = format->name;
    return loaded;
}

Result<Buffer> write_scene(const scene::Gaussians& gaussians, const SceneFormat& format,
                           const SaveOptions& options) {
    if (format.write == nullptr)
        return unsupported("%s is read only; write %s", format.name, extension_list(true).c_str());
    if (options.sh_degree.value_or(0) > format.max_sh_degree)
        return invalid("sh_degree %u to write, but %s holds at most %u", *options.sh_degree,
                       format.name, format.max_sh_degree);
    return format.write(gaussians, options);
}

}  // namespace splat::io
