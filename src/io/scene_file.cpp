#include "io/scene_file.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>

#include "core/fork.h"
#include "core/os/path.h"
#include "io/compress.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/reader.h"
#include "io/scene_formats.h"

namespace splat::io {
namespace {

/// The document that stands for a folder: that of SOG.
constexpr const char* kFolderDocument = "meta.json";

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

/// The rows by their ids, which are their places, counted from 1.
struct OrderedFormats {
    OrderedFormats() {
        for (const SceneFormat* row : scene_format_rows()) rows.push_back(*row);
        std::ranges::sort(rows, {}, &SceneFormat::id);
    }
    std::vector<SceneFormat> rows;
};

/// The format of the longest extension with which the name ends, of those that are written if `written`; null for
/// none: ".compressed.ply" is not ".ply".
const SceneFormat* named_format(const std::string& name, bool written) {
    std::string file = name.substr(name.find_last_of('/') + 1);  // 0 without a folder
    for (char& c : file) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    const SceneFormat* found = nullptr;
    for (const SceneFormat& format : scene_formats())
        if ((!written || format.write != nullptr) && file.ends_with(format.extension) &&
            (found == nullptr || std::strlen(format.extension) > std::strlen(found->extension)))
            found = &format;
    return found;
}

/// The file at a path; in a folder of SOG its document.
Result<std::string> document_at(const std::string& path) {
    const std::string document = os::text_of(os::path_of(path) / kFolderDocument);
    SPLAT_ASSIGN(const bool is_folder, has_file(document));
    return is_folder ? document : path;
}

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
    if (const SceneFormat* const format = named_format(name, false)) {
        if (format->detect == nullptr) return format;
        return damaged("'%s' is not a %s file: its first bytes differ; expected %s", name.c_str(),
                       format->extension, format->mark);
    }
    return damaged("'%s' is not a scene of a known format; expected %s", name.c_str(),
                   extension_list(false).c_str());
}

Result<const SceneFormat*> written_scene_format(const std::string& name) {
    if (const SceneFormat* const format = named_format(name, true)) return format;
    return unsupported("'%s': extension '%s', expected %s", name.c_str(),
                       extension_of(name).c_str(), extension_list(true).c_str());
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

Result<SceneHead> read_scene_head(Bytes file, const std::string& name, LoadOptions options,
                                  const SceneFormat* format) {
    SceneHead head;
    options.head = &head;
    const auto read = read_scene(file, name, options, format);
    if (read.status().code() == Code::kCancelled) return head;
    SPLAT_TRY(read.status());
    return SceneHead{read.value().report.count, read.value().report.sh_degree};
}

Result<LoadedScene> load_scene(const std::string& path, LoadOptions options,
                               const SceneFormat* format) {
    SPLAT_ASSIGN(const std::string file, document_at(path));
    SPLAT_ASSIGN(const Buffer bytes, read_file(file));
    options.folder = os::folder_of(file);
    options.discard = true;
    return read_scene(bytes, path, options, format);
}

Result<SceneHead> load_scene_head(const std::string& path, LoadOptions options,
                                  const SceneFormat* format) {
    SPLAT_ASSIGN(const std::string file, document_at(path));
    SPLAT_ASSIGN(const auto source, open_source(file, kMaxFileBytes, true));
    const auto mapped = source->map(false);
    Buffer bytes;
    if (mapped == nullptr) SPLAT_SET(bytes, read_file(file));
    options.folder = os::folder_of(file);
    return read_scene_head(mapped != nullptr ? mapped->bytes() : Bytes(bytes), path, options,
                           format);
}

Status put_scene(const scene::Gaussians& gaussians, const SceneFormat& format,
                 const SaveOptions& options, ByteSink& to) {
    if (format.write == nullptr)
        return unsupported("%s is read only; write %s", format.name, extension_list(true).c_str());
    if (options.sh_degree.value_or(0) > format.max_sh_degree)
        return invalid("sh_degree %u to write, but %s holds at most %u", *options.sh_degree,
                       format.name, format.max_sh_degree);
    warn_of_drawing(format.name, gaussians.drawn_as, format.says, format.always);
    return format.write(gaussians, options, to);
}

Result<Buffer> write_scene(const scene::Gaussians& gaussians, const SceneFormat& format,
                           const SaveOptions& options) {
    BufferSink file;
    SPLAT_TRY(put_scene(gaussians, format, options, file));
    return std::move(file.file);
}

}  // namespace splat::io
