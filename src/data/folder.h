#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/os/path.h"
#include "core/status.h"
#include "io/folder.h"
#include "io/image.h"
#include "io/reader.h"
#include "scene/vector.h"

namespace splat::data {

/// Names of the entries with this extension, without it; sorted, without those that start with '.'. None where there
/// is no such folder. Errors: kIo if it cannot be listed.
Result<std::vector<std::string>> stems_in(const std::filesystem::path& folder,
                                          const std::string& extension);

/// The status with kFormat for kNotFound, which would mean that the split is not there.
Status as_damage(const Status& status);

/// Errors: kFormat for a link that leads nowhere: what it stands for is not just absent.
Status check_link(io::PathKind kind, const std::filesystem::path& path);

/// Errors: kInvalidArgument for another split than train, val and test.
Status check_split(const std::string& split);

/// Names of the entries with an image's extension, sorted; the rest as stems_in().
Result<std::vector<std::string>> images_in(const std::filesystem::path& folder);

/// What may be objects: the names of a folder's folders, and of links that lead nowhere, which were folders. Sorted.
/// Errors: as io::entries_in().
Result<std::vector<std::string>> candidates_in(const std::filesystem::path& folder);

using io::in_file;

/// A row-major [3,4] or [4,4] as [4,4]. Errors: kFormat for another number of values.
Result<scene::Mat4> affine(std::span<const float> values);

/// The inverse of a pose, which need not be quite rigid. Errors: kFormat as check_pose().
Result<scene::Mat4> inverse_pose(const scene::Mat4& pose);

/// A square image of 8 bits, or all but its samples. Errors: as io::load_image(); kFormat if it is not square.
Result<io::Image> load_square(const std::filesystem::path& path, bool header_only);

/// An image of 8 bits and any size. Errors: as load_square().
Result<io::Image> load_bytes(const std::filesystem::path& path, const io::ImageOptions& options);

/// The same with samples of 8 bits, rounded.
io::Image reduced_to_bytes(io::Image image);

/// Largest distance of a camera from the origin of a data set, whose objects have sizes of about 1.
inline constexpr double kMostDistance = 1e6;

/// Finite, a rotation within 1e-3, not mirrored, within kMostDistance. Errors: kFormat, naming the place.
Status check_pose(const scene::Mat4& camera_to_world, const std::string& place);

}  // namespace splat::data
