#pragma once

#include <map>

#include "data/dataset.h"
#include "synthetic/sample_folder.h"

namespace splat::test {

/// A pose [3,4] without rotation, at -2 along z.
extern const std::vector<float> kPose;

/// Two cameras' numbers from those of one.
std::vector<float> twice(const std::vector<float>& values);

/// A transforms.json with these members and two frames, the second one unit to the right of the first.
std::string two_frames(const std::string& members, const char* first, const char* second);

/// An object of SRN's format, of two views of 8 x 8 pixels.
void put_object(const std::filesystem::path& folder);

void put_npy(const std::filesystem::path& path, std::vector<std::uint64_t> shape,
             std::vector<float> values);
void put_npz(const std::filesystem::path& path,
             const std::map<std::string, std::vector<float>>& arrays);

std::string numbered(std::size_t i);  ///< "007"

/// An object of Objaverse: [n,3,4] or [n,12] poses, one file each, with images of 8 x 8 pixels.
void put_renders(const std::filesystem::path& folder, const std::vector<float>& poses,
                 std::uint32_t channels = 4);

/// An object of NMR's category 02691156 and its list: world_mat_inv of `each` numbers.
void put_nmr(const std::filesystem::path& root, const std::vector<float>& world_mat_inv,
             std::size_t each, const std::string& name = "b");

struct Co3dSample {
    std::vector<float> r, t, focal;
    std::vector<float> images = std::vector<float>(t.size() * 64, 0.2F);
    std::string name = "106_1_2";
};

/// Two frames without rotation, 3 and 4 away.
Co3dSample two_co3d_frames(const std::string& name = "106_1_2");

/// A preprocessed sequence of hydrants; the only one that has cameras.
void put_co3d(const std::filesystem::path& root, const Co3dSample& sample);

data::DatasetDesc data_desc(const std::filesystem::path& path, const std::string& split = "train");

/// Where it cannot be opened, the test fails and ends.
std::unique_ptr<data::Dataset> open_data(const data::DatasetDesc& desc);
std::unique_ptr<data::Dataset> open_data(const std::filesystem::path& path,
                                         const std::string& split = "train");

/// Status of opening a data set and reading its first two images.
Status data_status(const data::DatasetDesc& desc);
Status data_status(const std::filesystem::path& path, const std::string& split = "train");

}  // namespace splat::test
