// Fits of photographs through the C API: what is refused, and a fit from beginning to end.
#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "api/api_calls.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

class ApiFit : public testing::Test {
  protected:
    void SetUp() override {
        fs::remove_all(place_);
        fs::create_directories(place_ / "photos");
    }
    void TearDown() override { fs::remove_all(place_); }

    /// Photographs of 40 x 28 pixels of three Gaussians, with their cameras.
    void write_photographs() {
        const float places[] = {-1, 0, 0.5F, 0, 0, 0.5F, 1, 0, 0.5F};
        const float scales[] = {-1, -1, -1, -1, -1, -1, -1, -1, -1}, logits[] = {3, 3, 3};
        const float colors[] = {1, 0, -1, 0, 1, -1, -1, 0, 1};
        auto desc = sized<splat_scene_desc>();
        desc.count = 3;
        desc.means = places;
        desc.mean_count = std::size(places);
        desc.log_scales = scales;
        desc.log_scale_count = std::size(scales);
        desc.opacity_logits = logits;
        desc.opacity_logit_count = std::size(logits);
        desc.sh = colors;
        desc.sh_count = std::size(colors);
        const Scene scene = got(splat_scene_create, &desc);
        auto orbit = sized<splat_orbit_desc>();
        orbit.width = 40;
        orbit.height = 28;
        splat_camera cameras[6];
        ASSERT_DONE(splat_camera_orbit(scene, &orbit, 6, cameras));
        std::vector<std::string> names;
        std::vector<const char*> texts;
        for (std::size_t i = 0; i < 6; ++i) names.push_back(std::to_string(i) + ".png");
        for (std::size_t i = 0; i < 6; ++i) {
            std::vector<unsigned char> pixels(std::size_t{3} * 40 * 28);
            splat_image image{};
            image.pixels = pixels.data();
            image.bytes = pixels.size();
            image.type = SPLAT_PIXEL_U8;
            image.width = 40;
            image.height = 28;
            image.channels = 3;
            ASSERT_DONE(splat_scene_render(scene, device_, &cameras[i], 1, nullptr, &image));
            ASSERT_DONE(splat_image_save((place_ / "photos" / names[i]).string().c_str(), &image));
            texts.push_back(names[i].c_str());
        }
        ASSERT_DONE(splat_camera_save((place_ / "photos/transforms.json").string().c_str(), cameras,
                                      texts.data(), 6));
    }

    [[nodiscard]] splat_fit_desc desc() const {
        auto desc = sized<splat_fit_desc>();
        desc.folder = run_.c_str();
        desc.data = photos_.c_str();
        desc.steps = 30;
        desc.test_every = 3;
        return desc;
    }
    void refused_with(splat_result code, const char* part, const splat_fit_desc& desc) {
        splat_run run = nullptr;
        EXPECT_REFUSED(splat_fit_open(device_, &desc, &run), code, part);
        EXPECT_EQ(run, nullptr);
        EXPECT_FALSE(fs::exists(run_));
    }

    Device device_ = open_device();
    fs::path place_ = run_folder();
    std::string run_ = (place_ / "run").string(), photos_ = (place_ / "photos").string();
};

TEST_F(ApiFit, RefusesWhatMeansNothing) {
    const auto with = [this](auto&& change) {
        splat_fit_desc wrong = desc();
        change(wrong);
        return wrong;
    };
    constexpr splat_result kArgument = SPLAT_ERROR_INVALID_ARGUMENT;
    refused_with(kArgument, "data is NULL", with([](auto& d) { d.data = nullptr; }));
    refused_with(kArgument, "folder is NULL", with([](auto& d) { d.folder = nullptr; }));
    refused_with(kArgument, "sh_bands is 5", with([](auto& d) { d.sh_bands = 5; }));
    refused_with(kArgument, "cameras is 3", with([](auto& d) { d.cameras = 3; }));
    refused_with(kArgument, "test_every is 3",
                 with([](auto& d) { d.flags = SPLAT_FIT_ALL_PHOTOS; }));
    refused_with(kArgument, "resume the run and to overwrite it",
                 with([](auto& d) { d.flags = SPLAT_FIT_RESUME | SPLAT_FIT_OVERWRITE; }));
    refused_with(kArgument, "seconds is 2 and steps 30", with([](auto& d) { d.seconds = 2; }));
    refused_with(kArgument, "seconds is -1", with([](auto& d) {
                     d.steps = 0;
                     d.seconds = -1;
                 }));
    refused_with(kArgument, "max_gaussians is 1", with([](auto& d) { d.max_gaussians = 1; }));
    refused_with(kArgument, "downscale is 65", with([](auto& d) { d.downscale = 65; }));
    refused_with(kArgument, "seed is", with([](auto& d) { d.seed = UINT64_MAX; }));
    refused_with(SPLAT_ERROR_INVALID_STATE, "run",
                 with([](auto& d) { d.flags = SPLAT_FIT_RESUME; }));
    refused_with(SPLAT_ERROR_NOT_FOUND, "has no cameras", desc());
    write_photographs();
    refused_with(SPLAT_ERROR_NOT_FOUND, "nowhere", with([](auto& d) { d.masks = "/nowhere"; }));
    refused_with(SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, "but has 9 MB: allow more memory",
                 with([](auto& d) { d.memory_bytes = 9000000; }));
    std::ofstream(place_ / "photos/4.png") << "no picture";
    refused_with(SPLAT_ERROR_FORMAT, "4.png", desc());
}

TEST_F(ApiFit, OpeningIsCancelled) {
    write_photographs();
    std::atomic<bool> done = false;
    std::thread other([&] {
        while (!done) EXPECT_DONE(splat_device_cancel(device_));
    });
    const splat_fit_desc asked = desc();
    splat_run run = nullptr;
    const splat_result opened = splat_fit_open(device_, &asked, &run);
    done = true;
    other.join();
    EXPECT_EQ(opened, SPLAT_CANCELLED);
    EXPECT_FALSE(fs::exists(run_));
}

TEST_F(ApiFit, FitsAndGivesItsScene) {
    write_photographs();
    const splat_fit_desc asked = desc();
    const Training run = got(splat_fit_open, device_, &asked);
    auto event = sized<splat_run_event>();
    std::uint32_t held_out = 0;
    double fitted = 0, psnr = 0;
    while (event.kind < SPLAT_EVENT_DONE) {
        ASSERT_DONE(splat_run_next(run, &event));
        if (event.kind == SPLAT_EVENT_VALIDATED_PIECE && event.step == 30) ++held_out;
        if (event.kind == SPLAT_EVENT_VALIDATION) fitted = event.numbers[0].value;
    }
    EXPECT_EQ(event.kind, SPLAT_EVENT_DONE);
    EXPECT_EQ(held_out, 2U);  // the first and the fourth of six
    const Scene scene = got(splat_fit_scene, run);
    const auto info = got(splat_scene_get_info, scene);
    EXPECT_GT(info.count, 100U);
    EXPECT_EQ(info.sh_degree, 3U);
    EXPECT_EQ(info.non_finite, 0U);
    EXPECT_TRUE(holds(text_of(splat_run_report, run), "\"val_ssim\": 0."));
    splat_fit_desc other = asked;  // what a score does not read
    other.seconds = -1;
    other.sh_bands = 9;
    other.depth = other.init = "nowhere";
    const Training scoring = got(splat_fit_score, device_, &other, scene, 0.1);
    std::vector<std::string> names;
    event.kind = SPLAT_EVENT_MESSAGE;
    while (event.kind < SPLAT_EVENT_DONE) {
        ASSERT_DONE(splat_run_next(scoring, &event));
        if (event.kind == SPLAT_EVENT_VALIDATED_PIECE) names.emplace_back(event.name);
        if (event.kind == SPLAT_EVENT_VALIDATION) psnr = event.numbers[0].value;
    }
    EXPECT_EQ(names, (std::vector<std::string>{"0.png", "3.png"}));
    EXPECT_NEAR(psnr, fitted, 1e-3);
    splat_run refused = nullptr;
    constexpr splat_result kArgument = SPLAT_ERROR_INVALID_ARGUMENT;
    EXPECT_REFUSED(splat_fit_score(device_, &asked, scene, 0.5, &refused), kArgument,
                   "border is 0.5");
    EXPECT_REFUSED(splat_fit_score(device_, &asked, nullptr, 0, &refused),
                   SPLAT_ERROR_INVALID_HANDLE, "scene");
    splat_scene none = nullptr;
    EXPECT_REFUSED(splat_fit_scene(scoring, &none), kArgument, "run is no fit");
    const Training training = make_training(device_);
    EXPECT_REFUSED(splat_fit_scene(training, &none), SPLAT_ERROR_INVALID_ARGUMENT, "run is no fit");
}

}  // namespace
}  // namespace splat::test
