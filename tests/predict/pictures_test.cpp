#include "predict/pictures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "data/relative_pose.h"
#include "scene/camera_pose.h"
#include "support/expect_status.h"

namespace splat::predict {
namespace {

constexpr std::array<float, 3> kWhite = {1, 1, 1};

/// A dark square of 20 pixels, left of the middle of a light picture.
data::NamedImage picture(std::uint32_t channels = 3, std::uint16_t dark = 30) {
    io::Image image;
    image.width = 80;
    image.height = 60;
    image.channels = channels;
    for (std::uint32_t y = 0; y < image.height; ++y)
        for (std::uint32_t x = 0; x < image.width; ++x) {
            const bool inside = x >= 20 && x < 40 && y >= 20 && y < 40;
            for (std::uint32_t c = 0; c < channels; ++c)
                image.samples.push_back(inside ? static_cast<std::uint16_t>(dark + 10 * c) : 220);
        }
    return {std::move(image), "the picture", {}};
}

PictureInput input_of(data::NamedImage image) {
    PictureInput input;
    input.picture.image = std::move(image);
    return input;
}

config::ModelConfig network() {
    config::ModelConfig config;
    config.resolution = 32;
    return config;
}

Result<PictureViews> views_of(const config::ModelConfig& config, const PictureInput& input) {
    return views_of_pictures(config, kWhite, std::span(&input, 1));
}

void expect_refused(const config::ModelConfig& config, const PictureInput& input,
                    const char* part) {
    EXPECT_ERROR(views_of(config, input), Code::kInvalidArgument, part);
}

TEST(Pictures, OnePictureIsSeenByTheCameraOfTheNetwork) {
    const PictureViews given = need(views_of(network(), input_of(picture())));
    ASSERT_EQ(given.views.inputs.size(), 3U * 32 * 32);
    EXPECT_EQ(given.views.inputs, given.views.images);
    EXPECT_EQ(given.facts[0].found, data::MaskFrom::kBorder);
    EXPECT_EQ(given.facts[0].side, 31) << "20 / 0.65";
    EXPECT_EQ(given.facts[0].width, 80U);
    EXPECT_EQ(given.facts[0].fov_degrees, 0) << "no focal length";
    const std::vector<float> identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    EXPECT_EQ(given.views.view_to_world, identity);
    EXPECT_EQ(given.views.quaternions, (std::vector<float>{1, 0, 0, 0}));
    const auto camera = need(scene::camera_from_fov(
        32, 32, static_cast<double>(network().fov_degrees) * std::numbers::pi / 180));
    EXPECT_EQ(given.views.cameras[0].fx, camera.fx);
    EXPECT_EQ(given.views.cameras[0].world_to_camera, camera.world_to_camera);
}

TEST(Pictures, MapsFollowTheColours) {
    config::ModelConfig config = network();
    config.depth = config.normal = config.mask = config.origin_distance = true;
    PictureInput input = input_of(picture());
    input.picture.depth = picture(1, 100);
    input.picture.normal = picture(3, 150);
    input.origin_distance = 2.5;
    const auto made = need(views_of(config, input));
    const std::size_t area = std::size_t{32} * 32, middle = 16 * 32 + 16;
    const std::vector<float>& planes = made.views.inputs;
    ASSERT_EQ(planes.size(), 9 * area);
    EXPECT_NEAR(planes[middle], 30 / 255.0, 1e-6);
    EXPECT_NEAR(planes[3 * area + middle], 100 / 255.0, 1e-6) << "depth";
    EXPECT_NEAR(planes[5 * area + middle], 160 / 255.0, 1e-6) << "normal y";
    EXPECT_EQ(planes[7 * area + middle], 1) << "mask";
    EXPECT_EQ(planes[7 * area], 0);
    EXPECT_EQ(planes[8 * area], 2.5F) << "distance of the origin";
}

/// A network whose head takes depths, as that of F3D-Gaus: depths 2 to 4, colours and mask.
config::ModelConfig depth_network() {
    config::ModelConfig config = network();
    config.positions = kHeadInputDepth;
    config.mask = true;
    config.znear = 2;
    config.zfar = 4;
    return config;
}

/// Depths of 16 bits that grow to the right, of the picture's size or half of it.
data::NamedImage depth_map(std::uint32_t width = 80, std::uint32_t height = 60) {
    io::Image image;
    image.width = width;
    image.height = height;
    image.channels = 1;
    image.bits = 16;
    for (std::uint32_t i = 0; i < width * height; ++i)
        image.samples.push_back(static_cast<std::uint16_t>(7000 + i % width));
    return {std::move(image), "the map", {}};
}

TEST(Pictures, DepthsOfTheHeadAreInSceneUnits) {
    config::ModelConfig config = depth_network();
    config.resolution = 60;  // the central square as it is
    config.depth_farther = true;
    PictureInput input = input_of(picture());
    input.picture.depth = depth_map();
    const auto made = need(views_of(config, input));
    const std::size_t area = std::size_t{60} * 60;
    ASSERT_EQ(made.views.inputs.size(), 5 * area);
    const std::span<const float> planes(made.views.inputs);
    EXPECT_TRUE(made.facts[0].whole);
    EXPECT_EQ(made.facts[0].found, data::MaskFrom::kNothing) << "no flood";
    EXPECT_EQ(made.facts[0].side, 60);
    for (const float mask : planes.subspan(3 * area, area)) ASSERT_EQ(mask, 1);
    EXPECT_NEAR(planes[30 * 60 + 15], 30 / 255.0, 1e-6) << "columns 10 to 70, not cut out";
    const auto depths = planes.last(area);
    EXPECT_EQ(depths[0], 2);
    EXPECT_EQ(depths[59], 4);
    EXPECT_NEAR(depths[60 + 20], 2 + 2 * 20 / 59.0, 1e-6) << "all 16 bits";

    config.depth_farther = false;
    const auto nearer = need(views_of(config, input));
    EXPECT_EQ(nearer.views.inputs[4 * area], 4);
    EXPECT_EQ(nearer.views.inputs[4 * area + 59], 2);
    EXPECT_NEAR(nearer.views.inputs[4 * area + 20], 1 / (0.25 + 0.25 * 20 / 59.0), 1e-6)
        << "inverse depths are linear";

    input.picture.depth->exact.assign(std::size_t{80} * 60, 1e6F);
    input.picture.depth->exact[80 * 30 + 40] = 1e6F + 1;
    EXPECT_EQ(need(views_of(config, input)).views.inputs[4 * area], 4) << "numbers, not samples";
    input.picture.mask = picture(1, 30);
    for (std::uint16_t& sample : input.picture.mask->image.samples)
        sample = sample == 220 ? 255 : 0;
    const auto masked = need(views_of(config, input));
    EXPECT_EQ(masked.views.inputs[3 * area + 30 * 60 + 15], 0) << "the given mask";
}

TEST(Pictures, DepthsOfTheHeadAreRefusedWithASentence) {
    const config::ModelConfig config = depth_network();
    PictureInput input = input_of(picture());
    expect_refused(config, input, "pictures[0]: a depth map is missing, but the network takes one");
    input.picture.depth = depth_map(40, 30);
    EXPECT_OK(views_of(config, input)) << "another size of the same proportion";
    input.foreground = 0.5;
    expect_refused(config, input, "foreground is 0.5, but the network takes depths of whole");
    input.foreground = PictureInput().foreground;
    input.picture.depth = depth_map(60, 60);
    expect_refused(config, input,
                   "the map is 60 x 60 pixels, expected the proportion of the image's 80 x 60");
    input.picture.depth = depth_map();
    for (std::uint16_t& sample : input.picture.depth->image.samples) sample = 9;
    expect_refused(config, input, "the map has one depth everywhere, 9");
    input.picture.depth = depth_map();
    expect_refused(network(), input, "a depth map is given, but the network takes none");
}

TEST(Pictures, FocalLengthsScaleWithTheSquare) {
    config::ModelConfig config = network();
    config.fov_degrees = 0;
    PictureInput input = input_of(picture());
    input.focal = 62;
    const auto made = need(views_of(config, input));
    EXPECT_EQ(made.views.focals, (std::vector<float>{64, 64})) << "62 / 31 * 32";
    EXPECT_EQ(made.views.cameras[0].fx, 64);
    EXPECT_NEAR(made.facts[0].fov_degrees, 2 * std::atan(0.25) * 180 / std::numbers::pi, 1e-9);
}

TEST(Pictures, TellsAFieldOfViewThatDiffers) {
    PictureFacts facts;
    EXPECT_FALSE(field_of_view_differs(network(), facts)) << "not known";
    facts.fov_degrees = 60;
    EXPECT_FALSE(field_of_view_differs(network(), facts)) << "51.99 is near enough";
    facts.fov_degrees = 80;
    EXPECT_TRUE(field_of_view_differs(network(), facts));
    facts.fov_degrees = 20;
    EXPECT_TRUE(field_of_view_differs(network(), facts));
}

TEST(Pictures, SeveralViewsAreRelativeToTheFirst) {
    config::ModelConfig config = network();
    config.views = 2;
    std::vector<PictureInput> inputs = {input_of(picture()), input_of(picture())};
    for (PictureInput& input : inputs) input.crop = false;
    const auto first = scene::look_at({0, 0, -2}, {0, 0, 0}, scene::kUp);
    const auto second = need(scene::look_at({1, -0.5, -1.5}, {0, 0, 0}, scene::kUp));
    inputs[0].world_to_camera = first.value();
    inputs[1].world_to_camera = second;
    const auto made = need(views_of_pictures(config, kWhite, inputs));
    const Views& views = made.views;
    EXPECT_EQ(views.inputs.size(), 2U * 3 * 32 * 32);
    EXPECT_EQ(views.view_to_world[0], 1);
    EXPECT_NEAR(views.view_to_world[16 + 12], 1, 1e-6) << "x of the second, seen by the first";
    EXPECT_NEAR(views.view_to_world[16 + 14], 0.5, 1e-6);
    EXPECT_NEAR(scene::camera_center(views.cameras[1])[1], -0.5, 1e-6);
    // What both look at, 2 before the first camera, lies on the axis of the second.
    const scene::Mat4& pose = views.cameras[1].world_to_camera;
    EXPECT_NEAR(2 * pose[2] + pose[3], 0, 1e-6);
    EXPECT_NEAR(2 * pose[6] + pose[7], 0, 1e-6);
    EXPECT_NEAR(2 * pose[10] + pose[11], std::sqrt(3.5), 1e-6);
    EXPECT_EQ(made.facts[1].side, 60) << "whole pictures";

    inputs[1].world_to_camera = scene::Mat4{};
    EXPECT_ERROR(views_of_pictures(config, kWhite, inputs), Code::kInvalidArgument, "pictures[1]");
    inputs[1].world_to_camera = second;
    inputs[1].crop = true;
    EXPECT_ERROR(views_of_pictures(config, kWhite, inputs), Code::kInvalidArgument,
                 "pictures[1]: one of 2 views is to be cut out");
    inputs[1].world_to_camera.reset();
    EXPECT_ERROR(views_of_pictures(config, kWhite, inputs), Code::kInvalidArgument,
                 "pictures[1]: no pose");
    inputs.pop_back();
    EXPECT_ERROR(views_of_pictures(config, kWhite, inputs), Code::kInvalidArgument,
                 "1 pictures, expected 2");
}

TEST(Pictures, RefusesWhatTheNetworkDoesNotTake) {
    PictureInput input = input_of(picture());
    config::ModelConfig config = network();
    config.depth = true;
    expect_refused(config, input, "pictures[0]: a depth map is missing");
    input.picture.normal = picture();
    expect_refused(network(), input, "a normal map is given, but the network takes none");
    input = input_of(picture());
    input.origin_distance = 1;
    expect_refused(network(), input, "an origin distance is given");
    config = network();
    config.origin_distance = true;
    input.origin_distance = -1;
    expect_refused(config, input, "the origin distance is -1");
    config = network();
    config.plane = true;
    expect_refused(config, input_of(picture()), "an object of a data set instead");
    config = network();
    config.fov_degrees = 0;
    input = input_of(picture());
    expect_refused(config, input, "a focal length is missing");
    input.focal = NAN;
    expect_refused(config, input, "the focal length is nan");
    input = input_of(picture());
    input.tokens = {1};
    expect_refused(network(), input, "the array of tokens has 1 numbers, expected 0");
    input = input_of(picture());
    input.embedding = {1};
    expect_refused(network(), input, "the embedding has 1 numbers, expected 0");
    input = input_of(picture());
    input.world_to_camera = scene::Mat4{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    expect_refused(network(), input, "pictures[0]: a pose is given, but the network takes one");
}

}  // namespace
}  // namespace splat::predict
