#pragma once

#include <filesystem>

#include "core/os/path.h"
#include "data/dataset_reader.h"
#include "data/posed_photos.h"

namespace splat::data {

/// Maps of an object in folders depth/, normal/, mask/ and plane/ (or depths/ and so on) beside its images, with the
/// stems of its views ("a.png", or "a.jpg.png" as COLMAP's masks): takes the kinds that the object lacks out of
/// index.maps, except those of the flags `given`, and notes other files as not read. Errors: kIo; kFormat for a folder
/// with other stems, or two files of one; if lenient, a problem of the last object of the index.
Status find_map_files(const std::filesystem::path& folder, const std::vector<std::string>& stems,
                      bool lenient, DatasetIndex& index, std::uint32_t given = 0);

/// Errors: kNotFound if there is none.
Result<std::filesystem::path> map_file(const std::filesystem::path& folder, MapKind kind,
                                       const std::string& stem);

/// What the numbers of a depth map are.
enum class DepthNumbers { kNearness, kDistance };

/// A map of 8 bits from an image, or from a .npy of [height,width] or [height,width,channels]: vectors of normals,
/// masks of 0 to 1, depth, normals and distances of planes. Depth of .npy and of 16 bits is scaled between its least
/// and its most; of distances, their inverses are, and 0 stays 0. Distances of planes become shares of the greatest,
/// at least 1 / 255. Errors: as io::load_image(), io::read_npy() and check_planes(); kFormat for another shape, plane
/// maps without four channels, and for numbers that are not finite.
Result<io::Image> load_map(const std::filesystem::path& path, MapKind kind,
                           const io::ImageOptions& options,
                           DepthNumbers numbers = DepthNumbers::kNearness);

/// The map of depth of distances, of which 0 are not known: their inverses, scaled between the least and the most.
/// Errors: kFormat for numbers that are not finite.
Result<io::Image> nearness_of_distances(std::vector<float> distances, std::uint32_t width,
                                        std::uint32_t height);

/// Finds the maps of photographs in the folders of the options: NAME.npy, NAME.pfm or NAME.png, where NAME is the
/// photograph's name with or without its extension. Errors: kNotFound if any is missing.
Status find_photo_maps(const PosedPhotosOptions& options, const std::vector<std::string>& names);

/// Reads those of one photograph: depth as relative inverse depth, scaled between its least, 0, and its most, 1, and
/// not known where a distance is 0 or less; normals where their vectors are at least a half long. Errors: as
/// load_map(); kFormat for another size than the photograph's, other channels than 1 of depth and 3 of normals, one
/// value alone.
Status read_photo_maps(const PosedPhotosOptions& options, const std::string& name,
                       PosedPhoto& photo);

/// An object whose images and maps are files in its folder.
struct FilesObject {
    std::filesystem::path folder;
    std::vector<std::string> stems;   ///< names of the views, and of their maps
    std::vector<std::string> images;  ///< paths below the folder
};

/// A format of such objects.
class FilesReader : public ObjectsReader<FilesObject> {
  public:
    [[nodiscard]] Result<io::Image> image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                          bool header_only) const override;

  protected:
    using ObjectsReader::ObjectsReader;

    /// Add an object whose images are `before` + a name of a view + `after`. Errors: as DatasetIndex::add() and
    /// find_map_files().
    Result<bool> add(const std::filesystem::path& folder, const std::string& name,
                     const ViewNames& names, const std::string& before, const std::string& after);
};

}  // namespace splat::data
