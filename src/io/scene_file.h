#pragma once

#include <string>

#include "io/scene_load.h"

namespace splat::io {

enum class SceneFormat : std::uint8_t { kPly, kCompressedPly, kSplat, kSpz };

/// By the first bytes, and where they say nothing (.splat has no header) by the extension of `name`.
/// Errors: kUnsupported for a format that is known and not read, such as .ksplat, .sog and .glb;
/// kInvalidArgument for anything else, with the formats that are read.
Result<SceneFormat> detect_scene_format(Bytes file, const std::string& name);

/// Detects the format; `name` is used in messages. Errors: as detect_scene_format() and the readers.
Result<LoadedScene> read_scene(Bytes file, const std::string& name,
                               const LoadOptions& options = {});

/// By the reader of this format, whatever the name and, for .splat, the first bytes. Errors: as the
/// readers; kInvalidArgument naming both formats if the first bytes are the mark of another one.
Result<LoadedScene> read_scene_as(SceneFormat format, Bytes file, const std::string& name,
                                  const LoadOptions& options = {});

/// Errors: as read_file() and read_scene().
Result<LoadedScene> load_scene(const std::string& path, const LoadOptions& options = {});

/// Bytes in the format that the extension of `name` says: .ply, .splat or .spz. Errors: as the
/// writers; kUnsupported for other extensions.
Result<Buffer> write_scene(const scene::Gaussians& gaussians, const std::string& name,
                           const SaveOptions& options = {});

/// Errors: as write_scene() and write_file().
Status save_scene(const scene::Gaussians& gaussians, const std::string& path,
                  const SaveOptions& options = {});

}  // namespace splat::io
