// Photographs whose transforms.json gives no focal length: that of their Exif data.
#include "data/dataset.h"
#include "data/sample_formats.h"
#include "io/file.h"
#include "support/expect_status.h"
#include "support/sample_jpeg.h"
#include "synthetic/sample_folder.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

void put_jpeg(const fs::path& path, std::uint8_t millimetres) {
    fs::create_directories(path.parent_path());
    ASSERT_OK(io::write_file(path.string(), exif_jpeg(millimetres)));
}

Result<std::vector<float>> focals_of(const fs::path& folder) {
    SPLAT_ASSIGN(const auto dataset, Dataset::open(data_desc(folder, "train")));
    std::vector<float> focals(4);
    const std::uint32_t views[] = {0, 1};
    SPLAT_TRY(dataset->read(0, views, {.focals = focals.data()}));
    return focals;
}

TEST(ExifFocal, IsThatOfEachPhotographWhereTheFileGivesNone) {
    const SampleFolder folder;
    const fs::path file = folder / "scene/transforms.json";
    put_jpeg(folder / "scene/a.jpg", 36);
    put_jpeg(folder / "scene/b.jpg", 72);
    put_text(file, two_frames(R"("w": 12, "h": 8)", "a.jpg", "b.jpg"));
    const auto focals = need(focals_of(folder.path()));
    // The diagonals of 12 x 8 pixels and of 36 x 24 mm are 3 mm for a pixel.
    EXPECT_NEAR(focals[0], 12, 1e-4);
    EXPECT_NEAR(focals[2], 24, 1e-4);
    put_text(file, two_frames(R"("fl_x": 10, "w": 12, "h": 8)", "a.jpg", "b.jpg"));
    ASSERT_OK(focals_of(folder.path()));
    EXPECT_NEAR(focals_of(folder.path()).value()[0], 10, 1e-4) << "the file's own comes first";
    put_jpeg(folder / "scene/b.jpg", 0);
    put_text(file, two_frames(R"("w": 12, "h": 8)", "a.jpg", "b.jpg"));
    EXPECT_ERROR(focals_of(folder.path()), Code::kFormat,
                 "frame 1: neither 'fl_x' nor 'camera_angle_x' is given");
}

}  // namespace
}  // namespace splat::data
