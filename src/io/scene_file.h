#pragma once

#include <span>
#include <string>

#include "io/scene_load.h"

namespace splat::io {

/// One format of scene files: `extern const SceneFormat kFooFormat = {` at the beginning of a line of a file in
/// scenes/, where CMake finds it.
struct SceneFormat {
    std::int32_t id;        ///< SPLAT_SCENE_* of splat.h
    const char* name;       ///< in reports and messages
    const char* extension;  ///< with the point, in lower case; the longest that fits a name counts
    const char* holds;      ///< for help texts: what the format keeps of a scene
    const char* mark = nullptr;  ///< the first bytes, for messages; null where the format has none
    /// True if the first bytes are the mark; null where the format has none. Errors: of a header that
    /// starts with the mark and is damaged.
    Result<bool> (*detect)(Bytes file) = nullptr;
    Result<LoadedScene> (*read)(Bytes file, const LoadOptions& options);
    /// Puts a file, piece by piece where the format allows. Null where the format is only read.
    Status (*write)(const scene::Gaussians& gaussians, const SaveOptions& options,
                    ByteSink& to) = nullptr;
    std::uint32_t max_sh_degree = scene::kMaxShDegree;
    /// Axes of a file, unless LoadOptions or SaveOptions name others.
    scene::Frame frame = scene::Frame::kRdf;
    /// What a file can say of drawing it; write_scene() warns of the rest.
    scene::DrawnAs says = {};
    /// What every file says of it; put_scene() warns if the scene does not.
    scene::DrawnAs always = {};
};

/// The rows as CMake finds them.
std::span<const SceneFormat* const> scene_format_rows();

/// All formats by id: the first one has 1.
std::span<const SceneFormat> scene_formats();

/// By the first bytes; by the extension of `name` where no format's mark fits.
/// Errors: kFormat for any other file, with the formats that are read.
Result<const SceneFormat*> detect_scene_format(Bytes file, const std::string& name);

/// The format in which a file of this name is written, by its extension. Errors: kUnsupported.
Result<const SceneFormat*> written_scene_format(const std::string& name);

/// Reads a file of `format`, or of the format that is detected if it is null; `name` is used in
/// messages. Errors: as detect_scene_format() and the readers; kFormat naming both formats if
/// the first bytes are the mark of another one.
Result<LoadedScene> read_scene(Bytes file, const std::string& name, const LoadOptions& options = {},
                               const SceneFormat* format = nullptr);

/// What the file promises; reads no Gaussians. Errors: as read_scene().
Result<SceneHead> read_scene_head(Bytes file, const std::string& name, LoadOptions options = {},
                                  const SceneFormat* format = nullptr);

/// The same of the file at `path`, with the files beside it that it names; a folder stands for its
/// meta.json. Errors: as read_file(), too.
Result<LoadedScene> load_scene(const std::string& path, LoadOptions options = {},
                               const SceneFormat* format = nullptr);
Result<SceneHead> load_scene_head(const std::string& path, LoadOptions options = {},
                                  const SceneFormat* format = nullptr);

/// Put a file of a format. Errors: as the writers, and the sink's; kUnsupported for a format that is only read;
/// kInvalidArgument for a degree that the format does not hold.
Status put_scene(const scene::Gaussians& gaussians, const SceneFormat& format,
                 const SaveOptions& options, ByteSink& to);

/// The same in memory.
Result<Buffer> write_scene(const scene::Gaussians& gaussians, const SceneFormat& format,
                           const SaveOptions& options = {});

}  // namespace splat::io
