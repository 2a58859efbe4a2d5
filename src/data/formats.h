#pragma once

#include <span>

#include "data/dataset_reader.h"
#include "tables/table_kind.h"

/// The formats of data sets: is_<format>() tells whether a folder has its layout, open_<format>() reads it.
namespace splat::data {

/// The folder has the layout of SRN's data.
Result<bool> is_srn(const std::string& path);

/// SRN's ShapeNet renders: [{path}/srn_{category}/]{category}_{split}/{object}/ with intrinsics.txt,
/// pose/*.txt (16 numbers, row-major camera-to-world, OpenCV axes), rgb/*.png, and optionally maps, see map_files.h.
/// The path may also be the folder of one split. Colours are used as stored where images have alpha, as the published
/// code does.
///
/// Errors   naming folder or file: kNotFound without objects; kFormat for images without poses, poses
///          without images, an object of one view; kInvalidArgument for a folder of several categories
Result<std::unique_ptr<DatasetReader>> open_srn(const ReaderDesc& desc);

/// The pose of a text of SRN's files. Errors: kFormat with the place.
Result<scene::Mat4> pose_of_text(std::string_view text, const std::string& place);

/// CO3D as preprocessed for Splatter Image: [{path}/co3d_{category}_for_gs/]{split}/ with camera_Rs.npz,
/// camera_Ts.npz (an array of all frames for each sequence) and {sequence}/ with focal_lengths.npy [F,1,2]
/// (in half sides) and images_fg.npy, else images_full.npy, float32 [F,3,S,S] from 0 to 1, and optionally maps,
/// depths.npy and masks.npy [F,1,S,S], normals.npy [F,3,S,S] and planes.npy [F,4,S,S]. Sequences of the excluded file
/// are left out.
/// Precision: images are kept in 8 bits.
Result<bool> is_co3d(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_co3d(const ReaderDesc& desc);

/// OpenCV camera-to-world, row-major, of PyTorch3D's R [3,3] and T [3]. Errors: kFormat for a
/// matrix that is not a rotation.
Result<scene::Mat4> pose_of_co3d(std::span<const float> rotation,
                                 std::span<const float> translation);

/// ShapeNet renders of 64 x 64 pixels in NMR's layout: {path}/{category}/softras_{split}.lst names objects,
/// one per line; {path}/{category}/{object}/ holds image/*.{png,jpg} and cameras.npz with world_mat_inv_{i}
/// (camera-to-world), else world_mat_{i} (its inverse), [3,4] or [4,4], and camera_mat_{i}, and optionally maps, see
/// map_files.h. Objects are named "{category}_{object}", as the published code does. With a views file, the test
/// objects and their order are those of that file.
Result<bool> is_nmr(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_nmr(const ReaderDesc& desc);

/// OpenCV camera-to-world, row-major, of a world_mat_inv of [3,4] or [4,4]: y points up in its world, z in ours.
/// Errors: kFormat for a matrix that is not a rigid motion.
Result<scene::Mat4> pose_of_nmr(std::span<const float> world_mat_inv);

/// DISN's renders of ShapeNet: {path}/{image,albedo,depth,normal}/{category}/{object}/{easy,hard}/NN.png with
/// rendering_metadata.txt, of 224 x 224 pixels. Objects are named "{category}_{object}"; their easy views come before
/// the hard ones, whose objects are moved by the shifts of that file or not, which depth maps tell: points of a view
/// must be where the next one sees them. desc.category names one of the categories, or means all. There are no splits.
/// Depth that is not known, as of the background and of all beyond 1.41, is 0. Masks are the opacity of the images.
///
/// Errors   kFormat, naming file and line; by cameras() for hard views whose depth agrees with neither, or that have
///          none
/// Source   Xu et al. 2019, "DISN"; ShapenetRender_more_variation
Result<bool> is_disn(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_disn(const ReaderDesc& desc);
/// The same of the easy views, and of the hard ones.
Result<std::unique_ptr<DatasetReader>> open_disn_easy(const ReaderDesc& desc);
Result<std::unique_ptr<DatasetReader>> open_disn_hard(const ReaderDesc& desc);
/// Their colours without light as the images.
Result<bool> is_disn_albedo(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_disn_albedo(const ReaderDesc& desc);
/// False: disn_easy and disn_hard are only taken by name.
Result<bool> is_part_of_disn(const std::string& path);

/// Renders of Objaverse in Zero123's layout: {path}/{object}/*.png with *.npy of the same name,
/// world-to-camera [3,4] with OpenGL axes; focal length 140 pixels of 128; optionally maps in {object}/, see
/// map_files.h. The first 99 of 100 objects, rounded down, are for training and the others for validation: of the
/// list of objects in its order, else of the folders by name. There is no split for tests.
Result<bool> is_objaverse(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_objaverse(const ReaderDesc& desc);

/// The same in {path}/{object}/render_mvs_25/model/. The splits val and test hold all objects; there is none to train.
Result<bool> is_gso(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_gso(const ReaderDesc& desc);

/// OpenCV camera-to-world, row-major, of a world-to-camera [3,4] with OpenGL axes. Errors:
/// kFormat for a matrix that is not a rigid motion.
Result<scene::Mat4> pose_of_objaverse(std::span<const float> world_to_camera);

/// Photographs with cameras: a folder with transforms_{split}.json, else transforms.json (NeRF's), else a
/// COLMAP model (also in sparse/0 or sparse, with the images in images/); or a folder of such folders, one for each
/// object. Without transforms_{split}.json all splits are equal. Images become the largest square
/// around the principal point, and so do maps (see map_files.h), which have the images' sizes.
Result<bool> is_image_folder(const std::string& path);
/// A sentence on a folder that is no data set: it, images/ in it or a folder in it has pictures, but no cameras, or
/// pictures of a format that is not read. Else empty; what cannot be read counts as nothing.
std::string lack_of_cameras(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_image_folder(const ReaderDesc& desc);

/// A store of tables' rows (src/tables/store.h), or a folder of stores named after their splits.
///
/// Errors   kNotFound, naming the splits that are there; kFormat for damaged files
Result<std::unique_ptr<DatasetReader>> open_store(const ReaderDesc& desc);

/// The table of images of a kind, and back; both lists have one order. There is none of planes: table_of() gives no
/// table for them.
constexpr tables::Table table_of(MapKind kind) {
    return static_cast<tables::Table>(static_cast<std::uint32_t>(tables::Table::kRgb) +
                                      static_cast<std::uint32_t>(kind));
}
constexpr MapKind map_of(tables::Table table) {
    return static_cast<MapKind>(static_cast<std::uint32_t>(table) -
                                static_cast<std::uint32_t>(tables::Table::kRgb));
}

/// Where open_tables() keeps the store of a split: <path>/.splat/<split>.
std::string store_beside(const std::string& path, const std::string& split);

/// Tables in Parquet files: imported to store_beside() unless that is there from the same files, then read from it.
///
/// Errors   as tables::import_tables(); those of open_store()
Result<std::unique_ptr<DatasetReader>> open_tables(const ReaderDesc& desc);

}  // namespace splat::data
