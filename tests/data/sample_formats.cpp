#include "data/sample_formats.h"

#include <gtest/gtest.h>

#include "io/file.h"
#include "io/npy.h"
#include "io/weights_formats.h"
#include "support/expect_status.h"

namespace splat::test {

namespace fs = std::filesystem;

const std::vector<float> kPose = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -2};

std::vector<float> twice(const std::vector<float>& values) {
    std::vector<float> both = values;
    both.insert(both.end(), values.begin(), values.end());
    return both;
}

std::string two_frames(const std::string& members, const char* first, const char* second) {
    return format(R"({%s, "frames": [
    {"file_path": "%s", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]},
    {"file_path": "%s", "transform_matrix": [[1,0,0,1],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]})",
                  members.c_str(), first, second);
}

void put_object(const fs::path& folder) {
    put_text(folder / "intrinsics.txt", "10. 4. 4. 0.\n0. 0. 0.\n1.\n8 8\n");
    put_text(folder / "pose/000000.txt", "1 0 0 0\n0 1 0 0\n0 0 1 -2\n0 0 0 1\n");
    put_text(folder / "pose/000001.txt", "0 0 -1 2 0 1 0 0 1 0 0 0 0 0 0 1");
    put_image(folder / "rgb/000000.png", 8, 3);
    put_image(folder / "rgb/000001.png", 8, 3, 1);
}

void put_npy(const fs::path& path, std::vector<std::uint64_t> shape, std::vector<float> values) {
    const auto file = need(io::write_npy({std::move(shape), std::move(values)}));
    fs::create_directories(path.parent_path());
    ASSERT_OK(io::write_file(path.string(), file));
}

void put_npz(const fs::path& path, const std::map<std::string, std::vector<float>>& arrays) {
    io::NamedTensors tensors;
    for (const auto& [name, values] : arrays)
        ASSERT_OK(tensors.add(
            {name, {static_cast<std::int64_t>(values.size())}, io::NumberType::kF32, values}));
    const auto file = need(io::write_npz(tensors));
    fs::create_directories(path.parent_path());
    ASSERT_OK(io::write_file(path.string(), file.pieces()));
}

std::string numbered(std::size_t i) {
    return format("%03zu", i);
}

void put_renders(const fs::path& folder, const std::vector<float>& poses, std::uint32_t channels) {
    for (std::size_t i = 0; i < poses.size() / 12; ++i) {
        const auto first = poses.begin() + static_cast<std::ptrdiff_t>(i * 12);
        put_npy(folder / (numbered(i) + ".npy"), {3, 4}, {first, first + 12});
        put_image(folder / (numbered(i) + ".png"), 8, channels, static_cast<std::uint32_t>(i));
    }
}

void put_nmr(const fs::path& root, const std::vector<float>& world_mat_inv, std::size_t each,
             const std::string& name) {
    put_text(root / "02691156/softras_train.lst", "b\r\n\n");
    const fs::path object = root / "02691156" / name;
    std::map<std::string, std::vector<float>> arrays;
    for (std::size_t i = 0; i < world_mat_inv.size() / each; ++i) {
        const auto first = world_mat_inv.begin() + static_cast<std::ptrdiff_t>(i * each);
        arrays["world_mat_inv_" + std::to_string(i)] = {first,
                                                        first + static_cast<std::ptrdiff_t>(each)};
        arrays["camera_mat_" + std::to_string(i)] = {3.7320509F, 0, 0};
        put_image(object / "image" / (numbered(i) + ".png"), 8, 3);
    }
    put_npz(object / "cameras.npz", arrays);
}

Co3dSample two_co3d_frames(const std::string& name) {
    Co3dSample sample{
        .r = twice({1, 0, 0, 0, 1, 0, 0, 0, 1}), .t = {0, 0, 3, 0, 0, 4}, .focal = {2, 2, 2, 2}};
    sample.name = name;
    return sample;
}

void put_co3d(const fs::path& root, const Co3dSample& sample) {
    const fs::path split = root / "co3d_hydrant_for_gs/train";
    const std::uint64_t frames = sample.t.size() / 3;
    put_npz(split / "camera_Rs.npz", {{sample.name, sample.r}});
    put_npz(split / "camera_Ts.npz", {{sample.name, sample.t}});
    put_npy(split / sample.name / "focal_lengths.npy", {frames, 1, 2}, sample.focal);
    put_npy(split / sample.name / "images_full.npy", {frames, 3, 8, 8}, sample.images);
}

data::DatasetDesc data_desc(const fs::path& path, const std::string& split) {
    data::DatasetDesc desc;
    desc.path = path.string();
    desc.split = split;
    return desc;
}

std::unique_ptr<data::Dataset> open_data(const data::DatasetDesc& desc) {
    return need(data::Dataset::open(desc));
}

std::unique_ptr<data::Dataset> open_data(const fs::path& path, const std::string& split) {
    return open_data(data_desc(path, split));
}

Status data_status(const data::DatasetDesc& desc) {
    auto dataset = data::Dataset::open(desc);
    if (!dataset.ok()) return dataset.status();
    const std::uint32_t views[] = {0, 1};
    const std::size_t side = dataset.value()->resolution();
    std::vector<float> images(2 * 3 * side * side);
    return dataset.value()->read(0, views, {.images = images.data()});
}

Status data_status(const fs::path& path, const std::string& split) {
    return data_status(data_desc(path, split));
}

}  // namespace splat::test
