#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "core/os/path.h"
#include "core/status.h"
#include "io/image.h"
#include "scene/camera.h"

/// Folders of objects that are made one by one, and the texts of SRN's layout.
namespace splat::io {

/// intrinsics.txt of a camera.
std::string srn_intrinsics(const scene::Camera& camera);

/// pose/*.txt: row-major camera-to-world, OpenCV axes.
std::string srn_pose(const scene::Camera& camera);

/// Writes folder/kind/name.png, which does not exist. Errors: as write_png() and write_new_file().
Status write_picture(const std::filesystem::path& folder, const std::string& kind,
                     const std::string& name, const Image& picture);

/// True if the file `name` of a folder has this text, which tells the values that its data was made with; false
/// without the file. Errors: kInvalidArgument with both texts if it has another; as read_file().
Result<bool> is_made_with(const std::filesystem::path& folder, const char* name,
                          const std::string& values);

/// The same, and writes the file where there is none. Errors: also as write_file().
Status make_with(const std::filesystem::path& folder, const char* name, const std::string& values);

/// Write a folder once: it appears whole or not at all, and an existing one is kept. What killed processes left of
/// it is removed. Thread-safe, also for the same folder. Errors: those of write_folder().
Status write_once(const std::filesystem::path& folder,
                  const std::function<Status(const std::filesystem::path&)>& write);

}  // namespace splat::io
