#include "predict/view_source.h"

#include <gtest/gtest.h>

#include "scene/camera_pose.h"
#include "support/expect_status.h"
#include "synthetic/sample_folder.h"

namespace splat::predict {
namespace {

class ViewSourceTest : public testing::Test {
  protected:
    void SetUp() override {
        desc_ = test::sample_cars(folder_ / "cars");
        test::write_all(desc_);
        settings_.network.resolution = desc_.resolution;
        settings_.training.root = desc_.path;
    }
    std::unique_ptr<ViewSource> open(const std::string& split = "train") {
        return need(ViewSource::open(settings_, "", split));
    }
    std::shared_ptr<data::Dataset> dataset(std::array<float, 3> background,
                                           std::uint32_t resolution = 0) {
        data::DatasetDesc desc;
        desc.path = desc_.path;
        desc.resolution = resolution;
        desc.background = background;
        auto made = data::Dataset::open(desc);
        EXPECT_OK(made);
        return made.ok() ? std::shared_ptr(std::move(made.value())) : nullptr;
    }

    test::SampleFolder folder_;
    synthetic::WriterDesc desc_;
    config::Settings settings_;
};

/// Vectors of the training cars whose numbers say object and view.
TEST_F(ViewSourceTest, ReadsTheVectorsOfItsViews) {
    settings_.network.token_dim = 3;
    settings_.network.tokens = 2;
    EXPECT_ERROR(ViewSource::open(settings_, "", "train"), Code::kInvalidArgument,
                 "'data.tokens_file' is empty");
    config::Settings without = settings_;
    without.network.token_dim = without.network.tokens = 0;
    const auto plain = need(ViewSource::open(without, "", "train"));
    io::WeightsFile file;
    for (std::uint32_t object = 0; object < plain->objects(); ++object) {
        io::NamedTensor tensor;
        tensor.name = plain->name(object);
        tensor.dims = {plain->views_of(object), 3, 2};
        std::vector<float> values;
        for (std::uint32_t view = 0; view < plain->views_of(object); ++view)
            values.insert(values.end(), 6, static_cast<float>(100 * object + view));
        tensor.values = values;
        ASSERT_OK(file.tensors.add(std::move(tensor)));
    }
    ASSERT_OK(io::save_weights(file, desc_.path + "/tokens.npz"));
    settings_.training.tokens_file = "tokens.npz";  // in the folder of the data
    const auto source = open();
    ASSERT_NE(source, nullptr);
    const std::uint32_t numbers[] = {1, 0};
    const auto views = need(source->read(source->objects() - 1, numbers, 1));
    const auto expected = static_cast<float>(100 * (source->objects() - 1) + 1);
    EXPECT_EQ(views.tokens, std::vector<float>(6, expected));
    EXPECT_TRUE(views.embedding.empty());
}

TEST_F(ViewSourceTest, ReadsImagesInputsAndCamerasOfTheViews) {
    settings_.network.depth = settings_.network.mask = true;
    settings_.network.origin_distance = true;
    const auto source = open("test");
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->objects(), 1U);
    EXPECT_EQ(source->views_of(0), 4U);
    const std::uint32_t side = source->resolution();
    const std::size_t area = std::size_t{side} * side;
    const std::uint32_t numbers[] = {2, 0, 3};
    const Views v = need(source->read(0, numbers, 2));
    ASSERT_EQ(v.images.size(), 3 * 3 * area);
    ASSERT_EQ(v.inputs.size(), 2 * 6 * area);
    std::vector<float> depths(3 * area), masks(3 * area);
    ASSERT_OK(source->dataset().read(
        0, numbers, {nullptr, depths.data(), nullptr, masks.data(), nullptr, nullptr, nullptr}));
    for (std::size_t view = 0; view < 2; ++view) {
        const float* const input = v.inputs.data() + view * 6 * area;
        EXPECT_TRUE(std::equal(input, input + 3 * area, v.images.data() + view * 3 * area));
        EXPECT_TRUE(std::equal(input + 3 * area, input + 4 * area, depths.data() + view * area));
        EXPECT_TRUE(std::equal(input + 4 * area, input + 5 * area, masks.data() + view * area));
        EXPECT_EQ(input[5 * area], 0) << "not CO3D's: no distance of the origin";
    }
    ASSERT_EQ(v.cameras.size(), 3U);
    for (std::size_t view = 0; view < 3; ++view) {
        const scene::Camera& camera = v.cameras[view];
        EXPECT_OK(scene::check_camera(camera));
        EXPECT_EQ(camera.fx, static_cast<double>(v.focals[2 * view]));
        EXPECT_EQ(camera.cx, side / 2.0);
        const scene::Vec3 center = scene::camera_center(camera);
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(center[axis], v.view_to_world[16 * view + 12 + axis], 1e-6);
    }
}

TEST_F(ViewSourceTest, PlanesAreForTheNetworkForALossOrForBoth) {
    const std::uint32_t numbers[] = {1, 0, 2};
    test::put_planes(desc_.path);
    settings_.network.mask = true;
    const Views none = need(open()->read(0, numbers, 2));
    EXPECT_TRUE(none.planes.empty());
    settings_.network.plane = true;
    const auto source = open();
    const Views seen = need(source->read(0, numbers, 2));
    EXPECT_TRUE(seen.planes.empty()) << "no loss takes them";
    const std::size_t area = std::size_t{16} * 16;
    std::vector<float> planes(2 * 5 * area);
    ASSERT_OK(source->dataset().read(0, std::span(numbers).first(2), {.planes = planes.data()}));
    ASSERT_EQ(seen.inputs.size(), 2 * 9 * area);
    for (std::size_t view = 0; view < 2; ++view) {
        const float* const input = seen.inputs.data() + view * 9 * area;
        EXPECT_TRUE(std::equal(input, input + 4 * area, none.inputs.data() + view * 4 * area));
        EXPECT_TRUE(
            std::equal(input + 4 * area, input + 9 * area, planes.data() + view * 5 * area));
    }
    settings_.training.plane_weight = 0.1;
    EXPECT_EQ(need(open()->read(0, numbers, 2)).planes, planes) << "of the input views";
    settings_.network.plane = false;
    const Views both = need(open()->read(0, numbers, 2));
    EXPECT_EQ(both.planes, planes);
    EXPECT_EQ(both.inputs, none.inputs);
    const auto plain = need(ViewSource::open(without_map_losses(settings_), "", "train"));
    EXPECT_TRUE(need(plain->read(0, numbers, 2)).planes.empty());
}

TEST_F(ViewSourceTest, PlanesOfALossMustBeThere) {
    settings_.training.plane_weight = 0.1;
    EXPECT_ERROR(ViewSource::open(settings_, "", "train"), Code::kNotFound,
                 "maps requested: plane");
    EXPECT_ERROR(
        ViewSource::open(settings_, dataset({1, 1, 1})), Code::kInvalidArgument,
        "no plane maps for every object, which the configuration's opt.lambda_plane takes: "
        "'vkrun priors plane' makes plane maps, beside rgb/ folders");
    settings_.training.stages.resize(2);
    settings_.training.stages[1].plane_weight = 0.1;
    EXPECT_ERROR(ViewSource::open(settings_, "", "train"), Code::kNotFound,
                 "maps requested: plane");
    EXPECT_OK(ViewSource::open(without_map_losses(settings_), "", "train"));
}

TEST_F(ViewSourceTest, LargerIsNearerWhateverPicturesHave) {
    settings_.network.positions = kHeadInputDepth;
    const std::uint32_t numbers[] = {0};
    const Views nearer = need(open()->read(0, numbers, 1));
    settings_.network.depth_farther = true;
    EXPECT_EQ(need(open()->read(0, numbers, 1)).inputs, nearer.inputs);
    const std::size_t area = nearer.inputs.size() / 4;
    EXPECT_EQ(nearer.inputs[3 * area], settings_.network.zfar) << "0, the background";
}

TEST_F(ViewSourceTest, AnOpenDataSetGivesTheSameViews) {
    const auto source = open();
    auto given = need(ViewSource::open(settings_, dataset({1, 1, 1})));
    const std::uint32_t numbers[] = {0, 1};
    const auto a = need(source->read(1, numbers, 1)), b = need(given->read(1, numbers, 1));
    EXPECT_EQ(a.images, b.images);
    EXPECT_EQ(a.inputs, b.inputs);
}

/// One object differs; the others have the 51.99 degrees of data.fov.
TEST_F(ViewSourceTest, WarnsOfAnotherFieldOfView) {
    const auto warning = [&](std::uint32_t objects) {
        return need(open()->field_of_view_warning(objects));
    };
    EXPECT_EQ(warning(2), "");
    const std::string second = open()->name(1);
    for (const auto& entry : std::filesystem::recursive_directory_iterator(desc_.path))
        if (entry.path().filename() == "intrinsics.txt" &&
            entry.path().parent_path().filename() == second)
            test::put_text(entry.path(),
                           format("%g 0 0 0\n0 0 0\n1\n%u %u\n", desc_.resolution / 2.0,
                                  desc_.resolution, desc_.resolution));
    EXPECT_EQ(warning(1), "");
    EXPECT_HAS(warning(2), "is 51.99 to 90 degrees, but 'data.fov' is 51.99");
    settings_.network.fov_degrees = 0;
    EXPECT_EQ(warning(2), "");
}

TEST_F(ViewSourceTest, RefusesADataSetThatIsNotOfTheConfiguration) {
    const auto refused = [&](std::shared_ptr<data::Dataset> given, const char* part) {
        EXPECT_ERROR(ViewSource::open(settings_, std::move(given)), Code::kInvalidArgument, part);
    };
    refused(dataset({0, 0, 0}), "expected white of 'data.white_background'");
    refused(dataset({1, 1, 1}, 8), "8 x 8 pixels");
    settings_.training.root.clear();
    EXPECT_ERROR(ViewSource::open(settings_, "", "train"), Code::kInvalidArgument,
                 "'data.root' is empty");
}

TEST_F(ViewSourceTest, RefusesADataSetWithoutTheMapsOfTheNetwork) {
    std::vector<std::filesystem::path> depths;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(desc_.path))
        if (entry.path().filename() == "depth") depths.push_back(entry.path());
    for (const auto& path : depths) std::filesystem::remove_all(path);
    settings_.network.depth = true;
    EXPECT_ERROR(ViewSource::open(settings_, dataset({1, 1, 1})), Code::kInvalidArgument,
                 "no depth maps");
    EXPECT_ERROR(ViewSource::open(settings_, "", "train"), Code::kNotFound,
                 "maps requested: depth");
}

}  // namespace
}  // namespace splat::predict
