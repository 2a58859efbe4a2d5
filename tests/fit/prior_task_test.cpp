// Fits with maps of depth and normals, and with other Gaussians to begin with.
#include <gtest/gtest.h>

#include <cmath>

#include "fit/fit_task.h"
#include "io/file.h"
#include "io/scene_file.h"
#include "run/run.h"
#include "scene/arrays.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "synthetic/sample_folder.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

/// Photographs of a wall z = 4 with a ball of radius 1 before it, from places on a line; depth and normals.
class PriorTask : public testing::Test {
  protected:
    static constexpr std::uint32_t kWide = 45, kHigh = 34;
    static constexpr double kFocal = 40;
    static constexpr int kPlaces = 6;

    /// Where a ray from (x, 0, 0) ends, and the normal there.
    static std::pair<scene::Vec3, scene::Vec3> hit(double x, const scene::Vec3& ray) {
        const scene::Vec3 from(x, 0, 0), ball(0, 0, 2.5), to = from - ball;
        const double a = glm::dot(ray, ray), b = glm::dot(to, ray), c = glm::dot(to, to) - 1;
        const double root = b * b - a * c;
        const scene::Vec3 place = from + ray * (root > 0 ? (-b - std::sqrt(root)) / a : 4);
        return {place, root > 0 ? place - ball : scene::Vec3(0, 0, -1)};
    }
    static std::uint16_t byte(double value) {
        return static_cast<std::uint16_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
    }

    void SetUp() override {
        put_text(data_ / "cameras.txt", format("1 PINHOLE %u %u %g %g %g %g\n", kWide, kHigh,
                                               kFocal, kFocal, kWide / 2.0, kHigh / 2.0));
        std::string images, points;
        for (int i = 0; i < kPlaces; ++i) {
            const double x = 0.4 * i - 1;
            images += format("%d 1 0 0 0 %g 0 0 1 %d.png\n\n", i + 1, -x, i);
            io::Image photo{kWide, kHigh, 3, 8, {}}, depth{kWide, kHigh, 1, 16, {}}, normal = photo;
            for (std::uint32_t p = 0; p < kWide * kHigh; ++p) {
                const scene::Vec3 ray((p % kWide + 0.5 - kWide / 2.0) / kFocal,
                                      (p / kWide + 0.5 - kHigh / 2.0) / kFocal, 1);
                const auto [place, n] = hit(x, ray);
                for (std::size_t c = 0; c < 3; ++c) {
                    photo.samples.push_back(
                        byte(0.5 + 0.4 * std::sin(3 * place[c] + 2 * place[(c + 1) % 3])));
                    normal.samples.push_back(byte(0.5 + 0.5 * n[c]));
                }
                depth.samples.push_back(static_cast<std::uint16_t>(50000 / place.z - 5000 + i));
                if (p % 37 == 0)
                    points +=
                        format("%d %g %g %g 128 128 128 0.5\n", static_cast<int>(p) + 10000 * i + 1,
                               place.x, place.y, place.z);
            }
            put_png(data_ / format("images/%d.png", i), photo);
            put_png(data_ / format("depth/%d.png", i), depth);
            put_png(data_ / format("normal/%d.png", i), normal);
        }
        put_text(data_ / "images.txt", images);
        put_text(data_ / "points3D.txt", points);
    }

    [[nodiscard]] fit::FitDesc desc(std::uint64_t steps) const {
        fit::FitDesc desc;
        desc.data = data_.path().string();
        desc.steps = steps;
        desc.max_gaussians = 1000;
        desc.depth = (data_ / "depth").string();
        desc.normals = (data_ / "normal").string();
        return desc;
    }
    Result<std::unique_ptr<run::Run>> open(const char* name, const fit::FitDesc& desc,
                                           run::RunFolder::Mode mode = run::RunFolder::Mode::kNew) {
        return run::Run::open({(runs_ / name).string(), mode, "test"},
                              std::make_unique<fit::FitTask>(context_, desc), interrupt_);
    }
    /// To its end, or to `stop_after` steps, as a kill would. The latest numbers by their names.
    void go(run::Run& run, std::uint64_t stop_after = ~std::uint64_t{0}) {
        run::Event event;
        while (event.kind < run::EventKind::kDone) {
            ASSERT_OK(run.next(event));
            for (const auto& number : event.numbers) last_[number.name] = number.value;
            if (event.kind == run::EventKind::kStep && event.step >= stop_after) break;
        }
    }
    std::string result(const char* name) {
        return file_text(runs_ / name / "gaussians_last.safetensors");
    }

    SampleFolder data_, runs_;
    std::shared_ptr<vk::Context> context_{std::shared_ptr<void>(), shared_context()};
    Interrupt interrupt_;
    std::map<std::string, double> last_;
};

TEST_F(PriorTask, MapsPullAndResumeWithTheSameBits) {
    fit::FitDesc free = desc(20), held = free;
    free.values = {"depth_weight=1e-9", "normal_weight=1e-9"};
    held.values = {"depth_weight=1", "normal_weight=1"};
    go(*need(open("free", free)));
    const auto without = last_;
    go(*need(open("whole", held)));
    ASSERT_TRUE(last_.contains("depth") && last_.contains("normal"));
    EXPECT_LT(last_["depth"], 0.9 * without.at("depth"));
    EXPECT_LT(last_["normal"], 0.9 * without.at("normal"));
    go(*need(open("parts", held)), 11);
    go(*need(open("parts", {}, run::RunFolder::Mode::kResume)));
    EXPECT_EQ(result("parts"), result("whole"));
    fit::FitDesc other;
    other.values = {"depth_weight=0.3"};
    EXPECT_ERROR(open("parts", other, run::RunFolder::Mode::kResume), Code::kInvalidArgument,
                 "depth_weight differs from that of the run");
    put_png(data_ / "depth/1.png", {kWide, kHigh, 1, 8, [] {
                                        std::vector<std::uint16_t> samples(
                                            std::size_t{kWide} * kHigh, 3);
                                        samples[0] = 200;
                                        return samples;
                                    }()});
    EXPECT_ERROR(open("parts", {}, run::RunFolder::Mode::kResume), Code::kInvalidArgument,
                 "maps or points of");
}

TEST_F(PriorTask, WeightsOfZeroAreFitsWithoutMaps) {
    fit::FitDesc off = desc(6);
    off.values = {"depth_weight=0", "normal_weight=0"};
    go(*need(open("off", off)));
    EXPECT_FALSE(last_.contains("depth"));
    fit::FitDesc none = desc(6);
    none.depth.reset();
    none.normals.reset();
    go(*need(open("none", none)));
    EXPECT_EQ(result("off"), result("none"));
}

TEST_F(PriorTask, BeginsWithDepth) {
    fit::FitDesc dense = desc(2);
    dense.init = "depth";
    go(*need(open("dense", dense)));
    EXPECT_EQ(last_["gaussians"], 1000) << "as many as there may be";
    fs::remove(data_ / "points3D.txt");
    EXPECT_ERROR(open("pointless", dense), Code::kFormat, "can be aligned: each needs 16 points");
}

/// Without points the maps are aligned with what is drawn, in each step.
TEST_F(PriorTask, RandomPointsAndMapsWithoutAlignment) {
    fs::remove(data_ / "points3D.txt");
    fit::FitDesc random = desc(8);
    random.init = "random";
    go(*need(open("random", random)));
    EXPECT_GT(last_["depth"], 0);
    go(*need(open("again", random)));
    EXPECT_EQ(result("again"), result("random"));
}

TEST_F(PriorTask, BeginsWithAScene) {
    scene::Gaussians scene = scene::make_gaussians(300, 1);
    scene.means = normal_fill(900, 1, 0, 0.5);
    for (std::size_t i = 2; i < 900; i += 3) scene.means[i] += 3;
    scene.log_scales.assign(900, -2);
    const fs::path path = runs_ / "scene.ply";
    const io::SceneFormat& ply = *need(io::written_scene_format(path.string()));
    ASSERT_OK(io::write_file(path.string(), need(io::write_scene(scene, ply))));
    fit::FitDesc from = desc(1);
    from.init = path.string();
    from.sh_degree = 0;
    {
        fit::FitTask task(context_, from);
        run::Messages messages;
        ASSERT_OK(task.prepare(nullptr, messages).status());
        ASSERT_OK(task.start(messages));
        const scene::Gaussians found = need(task.scene());
        ASSERT_EQ(found.count(), 300U);
        for (std::size_t i = 0; i < 900; ++i) EXPECT_NEAR(found.means[i], scene.means[i], 1e-5);
    }
    from.sh_degree = 3;
    {
        fit::FitTask task(context_, from);
        run::Messages messages;
        ASSERT_OK(task.prepare(nullptr, messages).status());
        ASSERT_OK(task.start(messages));
        EXPECT_EQ(need(task.scene()).sh_degree, 1U) << "as in its file";
    }
    from.max_gaussians = 299;
    EXPECT_ERROR(open("many", from), Code::kInvalidArgument,
                 "has 300 Gaussians, but the fit takes at most 299: raise max_gaussians");
    from.init = "dense";
    EXPECT_ERROR(open("unknown", from), Code::kNotFound,
                 "init is 'dense', expected points, depth, random or a file of a scene");
    scene.means[5] = std::numeric_limits<float>::quiet_NaN();
    ASSERT_OK(io::write_file(path.string(), need(io::write_scene(scene, ply))));
    from.init = path.string();
    EXPECT_ERROR(open("nan", from), Code::kFormat, "1 values of which are not finite");
}

}  // namespace
}  // namespace splat::test
