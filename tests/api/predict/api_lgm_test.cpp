// LGM's network through the C API: four pictures to a scene.
#include "api/predict/picture_calls.h"

namespace splat::test {
namespace {

constexpr const char* kLgm =
    "data: {training_resolution: 32, input_images: 4, fov: 49.1, znear: 0.5, zfar: 2.5}\n"
    "model: {network: lgm_unet, head: lgm, down: [32, 64], down_attention: [0, 1], up: [64, 32], "
    "up_attention: [1, 0]}\n";

class ApiLgm : public testing::Test {
  protected:
    void SetUp() override {
        auto desc = sized<splat_model_desc>();
        desc.config = kLgm;
        model_ = got(splat_model_create, device_, desc);
        EXPECT_DONE(splat_model_init(model_, 3));
        weights_ = got(splat_model_store, model_);
        for (std::vector<std::uint8_t>& bytes : bytes_) {
            bytes = picture_bytes(3);
            splat_picture picture{};
            picture.image.pixels = image_of(bytes, 3);
            picture.flags = SPLAT_PICTURE_WHOLE;
            pictures_.push_back(picture);
        }
    }
    Predictor predictor(const char* config = kLgm) {
        auto desc = sized<splat_predictor_desc>();
        desc.weights = weights_.get();
        desc.config = config;
        return got(splat_predictor_create, device_, desc);
    }

    Device device_ = open_device();
    Model model_;
    Weights weights_;
    std::array<std::vector<std::uint8_t>, 4> bytes_;
    std::vector<splat_picture> pictures_;
};

TEST_F(ApiLgm, FourPicturesMakeAScene) {
    const Predictor made = predictor();
    const auto info = got(splat_predictor_get_info, made);
    EXPECT_EQ(info.views, 4U);
    EXPECT_EQ(info.channels, 9U);
    EXPECT_EQ(info.gaussians, 4096U);
    EXPECT_EQ(info.sh_degree, 0U);
    std::vector<splat_camera> cameras(4);
    auto facts = sized<splat_prediction>();
    facts.cameras = cameras.data();
    facts.camera_capacity = 4;
    Scene scene;
    ASSERT_DONE(splat_predictor_predict(made, pictures_.data(), 4, scene.out(), &facts));
    EXPECT_EQ(facts.camera_count, 4U);
    EXPECT_EQ(facts.gaussians + facts.faint + facts.not_finite, 4096U);
    EXPECT_NEAR(cameras[0].world_to_camera[11], 1.5, 1e-6) << "the origin is before the first";
    EXPECT_NEAR(cameras[2].world_to_camera[0], -1, 1e-6) << "the third looks from behind";
    EXPECT_EQ(got(splat_scene_get_info, scene).sh_degree, 0U);
}

TEST_F(ApiLgm, RefusesOtherPicturesAndWeights) {
    const Predictor made = predictor();
    Scene scene;
    EXPECT_REFUSED(splat_predictor_predict(made, pictures_.data(), 1, scene.out(), nullptr),
                   SPLAT_ERROR_INVALID_ARGUMENT,
                   "1 picture, expected 4: LGM's network takes views of one object from the front");
    const std::vector<std::uint8_t> other(std::size_t{16} * 16 * 3, 90);
    pictures_[2].image.pixels = packed_image(other, 16, 16, 3);
    EXPECT_REFUSED(splat_predictor_predict(made, pictures_.data(), 4, scene.out(), nullptr),
                   SPLAT_ERROR_INVALID_ARGUMENT,
                   "pictures[2] has 16 x 16 pixels, expected 32 x 24 as pictures[0]");
    EXPECT_EQ(scene.get(), nullptr);
    auto desc = sized<splat_predictor_desc>();
    desc.weights = weights_.get();
    desc.config = "{}";
    Predictor song;
    EXPECT_REFUSED(
        splat_predictor_create(device_, &desc, song.out()), SPLAT_ERROR_FORMAT,
        "the weights are of another network than the configuration's: its tensors fit no "
        "published configuration; the nearest is lgm-");
}

}  // namespace
}  // namespace splat::test
