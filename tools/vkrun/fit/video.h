#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/os/path.h"

namespace vkrun {

/// Whether a path names a file of a video, by its extension.
bool is_video(const std::filesystem::path& path);

/// How many frames a video has, by ffprobe. Throws a Failure with what to do: ffmpeg is missing, the file is no video
/// that it reads, or has too few frames.
std::uint64_t count_frames(const std::string& video);

/// Write the sharpest frame of each of `wanted` equal parts of a video of `frames` frames, or every frame of a short
/// one, as frame_N.png, N its number, with sides of at most 1600 pixels; the folder appears whole or not at all. ffmpeg
/// decodes, once, and what it says goes to `log`. Sharp is a frame with a large variance of the Laplacian of its gray
/// values. Throws a Failure for a video without motion, and as run_child().
void extract_frames(const std::string& video, std::uint64_t frames,
                    const std::filesystem::path& folder, std::uint32_t wanted,
                    const std::string& log);

}  // namespace vkrun
