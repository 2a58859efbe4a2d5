#include <filesystem>
#include <fstream>

#include "api/raster_calls.h"
#include "api/scenario/scenario_calls.h"
#include "support/system.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kCount = 5;
constexpr std::uint32_t kWidth = 20;
constexpr std::uint32_t kHeight = 18;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

constexpr const char* kCameras =
    R"({"camera_angle_x": 0.8, "w": 20, "h": 18, "frames": [{"file_path": "a/one.png",
        "note": {"of": ["no", null, {"use": true}]},
        "transform_matrix": [[1,0,0,0],[0,-1,0,0],[0,0,-1,-4],[0,0,0,1]]}]})";

/// A folder with a file of cameras.
class Folder {
  public:
    Folder() : path_(fs::temp_directory_path() / ("splat_life_" + test::process_text())) {
        fs::create_directories(path_);
        std::ofstream(cameras()) << kCameras;
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() {
        for (const auto& file : fs::directory_iterator(path_))
            EXPECT_TRUE(file.path() == cameras() || file.path() == scene())
                << file << " was left behind";
        std::error_code failed;
        fs::remove_all(path_, failed);
    }

    [[nodiscard]] std::string cameras() const { return (path_ / "cameras.json").string(); }
    [[nodiscard]] std::string scene() const { return (path_ / "scene.ply").string(); }

  private:
    fs::path path_;
};

class RasterScenario : ScenarioCalls {
  public:
    explicit RasterScenario(Observer& observer) : ScenarioCalls(observer) {}
    RasterScenario(const RasterScenario&) = delete;
    RasterScenario& operator=(const RasterScenario&) = delete;

    ~RasterScenario() {
        for (const splat_tensor tensor : {grad_rgb_, grad_means_, grad_sh_})
            if (tensor != nullptr) SPLAT_DESTROY(splat_tensor_destroy, tensor);
        // Objects of the device outlive it.
        SPLAT_DESTROY(splat_device_destroy, device_);
        SPLAT_DESTROY(splat_rasterizer_destroy, rasterizer_);
        for (const splat_scene scene : {made_, loaded_}) SPLAT_DESTROY(splat_scene_destroy, scene);
    }

    bool run(const splat_device_desc& desc) {
        return SPLAT_MAKE(device_, splat_device_create, &desc) && make_scene() && load_files() &&
               make_tensors() && draw() && go_back() && change();
    }

    ScenarioResults results;

  private:
    bool make_scene() {
        const splat_scene_desc desc = sample_.desc();
        const std::string file =
            folder_.scene();  // outside the call, whose own allocations may fail
        return SPLAT_MAKE(made_, splat_scene_create, &desc) &&
               SPLAT_STEP(splat_scene_save, made_, file.c_str(), nullptr);
    }

    bool load_files() {
        Output<std::uint32_t> count;
        Output<splat_camera> camera;
        const std::string cameras = folder_.cameras();
        if (!SPLAT_STEP_WITH(count.untouched() && camera.untouched(), splat_camera_load,
                             cameras.c_str(), nullptr, camera.out(), 1, count.out()))
            return false;
        EXPECT_EQ(count.value(), 1U);
        camera_ = camera.value();
        const std::string scene = folder_.scene();
        return SPLAT_MAKE(loaded_, splat_scene_load, scene.c_str(), nullptr);
    }

    bool make_tensor(const char* name, splat_tensor& tensor, const Dims& dims, std::size_t count) {
        const splat_tensor_desc desc = tensor_desc(dims, name);
        const Floats values(count, 0.25F);
        return SPLAT_MAKE(tensor, splat_tensor_from_host, device_, &desc, values.data(), count * 4,
                          nullptr);
    }

    bool make_tensors() {
        return make_tensor("grad_rgb", grad_rgb_, {1, kHeight, kWidth, 3}, 3 * kPixels) &&
               make_tensor("grad_means", grad_means_, {kCount, 3}, 3 * kCount) &&
               make_tensor("grad_sh", grad_sh_, {kCount, 4, 3}, 12 * kCount);
    }

    bool forward() {
        return SPLAT_STEP(splat_rasterizer_forward_scene, rasterizer_, nullptr, loaded_, &camera_,
                          1, nullptr);
    }

    bool read_image() {
        const Floats pattern(3 * kPixels, -77.0F);
        Floats values = pattern;
        const bool done =
            SPLAT_STEP_WITH(same_bits(values, pattern), splat_rasterizer_read, rasterizer_, nullptr,
                            SPLAT_OUTPUT_RGB, values.data(), values.size() * sizeof(float));
        results.tensors.push_back(std::move(values));
        return done;
    }

    bool draw() {
        const splat_rasterizer_desc desc =
            rasterizer_desc(kCount, kWidth, kHeight, SPLAT_RASTERIZER_BACKWARD);
        return SPLAT_MAKE(rasterizer_, splat_rasterizer_create, device_, &desc) && forward() &&
               read_image();
    }

    bool read_tensor(splat_tensor tensor, std::size_t count) {
        Floats values(count);
        const bool done =
            SPLAT_STEP(splat_tensor_read, tensor, values.data(), count * sizeof(float), nullptr);
        results.tensors.push_back(std::move(values));
        return done;
    }

    bool go_back() {
        auto desc = sized<splat_gradients_desc>();
        desc.grad_rgb = grad_rgb_;
        desc.grad_means = grad_means_;
        desc.grad_sh = grad_sh_;
        return SPLAT_STEP(splat_rasterizer_backward, rasterizer_, nullptr, &desc) &&
               read_tensor(grad_means_, 3 * kCount) && read_tensor(grad_sh_, 12 * kCount);
    }

    bool change() {
        splat_similarity similarity{};
        similarity.rotation[0] = 1;
        similarity.scale = 1.5;
        return SPLAT_STEP(splat_scene_transform, loaded_, &similarity) && forward() && read_image();
    }

    const Folder folder_;
    const SampleScene sample_{kCount};
    splat_camera camera_{};
    splat_device device_ = nullptr;
    splat_scene made_ = nullptr;
    splat_scene loaded_ = nullptr;
    splat_rasterizer rasterizer_ = nullptr;
    splat_tensor grad_rgb_ = nullptr;
    splat_tensor grad_means_ = nullptr;
    splat_tensor grad_sh_ = nullptr;
};

}  // namespace

std::optional<ScenarioResults> run_raster_scenario(Observer& observer,
                                                   const splat_device_desc& device) {
    return live<RasterScenario>(observer, device);
}

}  // namespace splat::test
