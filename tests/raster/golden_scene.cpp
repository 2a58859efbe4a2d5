#include "raster/golden_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace splat::test {
namespace {

/// The array of this name; empty if the file has none.
std::vector<double> numbers(const Npz& npz, const std::string& name) {
    if (!npz.has(name)) return {};
    return npz.find(name).value()->f64().value();
}

std::vector<std::int64_t> integers(const Npz& npz, const std::string& name) {
    if (!npz.has(name)) return {};
    return npz.find(name).value()->ints().value();
}

std::vector<float> floats(const Npz& npz, const std::string& name) {
    if (!npz.has(name)) return {};
    return npz.find(name).value()->f32().value();
}

std::vector<bool> flags(const Npz& npz, const std::string& name) {
    const std::vector<std::int64_t> values = integers(npz, name);
    return {values.begin(), values.end()};
}

/// 3dgs files hold one radius per Gaussian: its box is a square.
std::vector<std::int64_t> both_radii(std::vector<std::int64_t> radii, std::size_t count) {
    if (radii.size() != count) return radii;
    std::vector<std::int64_t> both;
    for (const std::int64_t radius : radii) both.insert(both.end(), 2, radius);
    return both;
}

}  // namespace

std::vector<GoldenLoss> golden_losses(const RasterMode& mode) {
    if (mode.is_3dgs())
        return {{"grad_rgb", false, ref::RasterGradient::kOriginal},
                {"grad_rgb_math", false, ref::RasterGradient::kTrue}};
    return {{"grad_rgb", false, ref::RasterGradient::kTrue},
            {"grad_all", true, ref::RasterGradient::kTrue}};
}

bool GoldenScene::has(const RasterMode& mode) const {
    return arrays.has(std::string(mode.name) + "/rgb");
}

RasterOutputs GoldenScene::outputs(const RasterMode& mode) const {
    const std::string folder = std::string(mode.name) + "/";
    RasterOutputs out;
    out.rgb = numbers(arrays, folder + "rgb");
    out.alpha = numbers(arrays, folder + "alpha");
    out.depth = numbers(arrays, folder + "depth_acc");
    out.depth_expected = numbers(arrays, folder + "depth_exp");
    out.n_contrib = integers(arrays, folder + "n_contrib");
    out.means2d = numbers(arrays, folder + "means2d");
    out.conics = numbers(arrays, folder + "conics");
    out.depths = numbers(arrays, folder + "depths");
    out.colors = numbers(arrays, folder + "colors");
    out.compensations = numbers(arrays, folder + "compensations");
    out.radii = both_radii(integers(arrays, folder + "radii"), inputs.count());
    out.valid = integers(arrays, folder + "valid");
    out.order = integers(arrays, folder + "order");
    out.tiles_rect = integers(arrays, folder + "tiles_rect");
    out.tiles_exact = integers(arrays, folder + "tiles_exact");
    out.pixels_visible = integers(arrays, folder + "pixels_visible");
    return out;
}

RasterGradients GoldenScene::gradients(const RasterMode& mode, const GoldenLoss& loss) const {
    const std::string folder = std::string(mode.name) + "/" + loss.name + "/";
    RasterGradients out;
    out.means = numbers(arrays, folder + "means");
    out.scales = numbers(arrays, folder + "scales");
    out.rotations = numbers(arrays, folder + "quats");
    out.opacities = numbers(arrays, folder + "opacities");
    out.sh = numbers(arrays, folder + "sh");
    out.colors = numbers(arrays, folder + "colors");
    out.means2d = numbers(arrays, folder + "means2d");
    out.conics = numbers(arrays, folder + "conics");
    out.world_to_camera = numbers(arrays, folder + "viewmat");
    out.twist = numbers(arrays, folder + "viewmat_twist");
    return out;
}

double GoldenScene::number(const std::string& name) const {
    const std::vector<double> values = numbers(arrays, name);
    EXPECT_EQ(values.size(), 1U) << inputs.name << ": " << name;
    return values.size() == 1 ? values[0] : std::nan("");
}

Result<GoldenScene> read_golden_scene(const std::string& path) {
    GoldenScene scene;
    SPLAT_ASSIGN(scene.arrays, Npz::read(path));
    const Npz& npz = scene.arrays;
    for (const char* name : {"in_means", "in_scales", "in_quats", "in_opacities", "in_sh", "in_bg",
                             "in_K", "in_viewmat", "in_W", "in_H", "w_rgb", "fragile"}) {
        const auto found = npz.find(name);
        if (!found.ok()) return found.status();
    }
    RasterCase& inputs = scene.inputs;
    inputs.name = golden_name(path);
    inputs.means = floats(npz, "in_means");
    inputs.scales = floats(npz, "in_scales");
    inputs.rotations = floats(npz, "in_quats");
    inputs.opacities = floats(npz, "in_opacities");
    inputs.sh = floats(npz, "in_sh");
    inputs.sh_coefficients = npz.find("in_sh").value()->shape.at(1);
    const std::vector<float> background = floats(npz, "in_bg");
    std::copy_n(background.begin(), 3, inputs.background.begin());
    const std::vector<float> K = floats(npz, "in_K");
    inputs.camera.fx = K.at(0);
    inputs.camera.cx = K.at(2);
    inputs.camera.fy = K.at(4);
    inputs.camera.cy = K.at(5);
    inputs.camera.width = static_cast<std::size_t>(integers(npz, "in_W").at(0));
    inputs.camera.height = static_cast<std::size_t>(integers(npz, "in_H").at(0));
    const std::vector<float> world_to_camera = floats(npz, "in_viewmat");
    std::copy_n(world_to_camera.begin(), 16, inputs.camera.world_to_camera.begin());
    scene.w_rgb = floats(npz, "w_rgb");
    scene.w_alpha = floats(npz, "w_alpha");
    scene.w_depth = floats(npz, "w_depth");
    scene.fragile = flags(npz, "fragile");
    scene.hostile = flags(npz, "hostile");
    if (npz.has("why")) {
        SPLAT_ASSIGN(scene.why, npz.find("why").value()->strings());
    }
    return scene;
}

std::vector<GoldenScene> golden_scenes(const std::string& family) {
    std::vector<GoldenScene> scenes;
    for (const std::string& path : golden_files("raster", family)) {
        auto scene = read_golden_scene(path);
        EXPECT_TRUE(scene.ok()) << scene.status().message();
        if (scene.ok()) scenes.push_back(std::move(scene.value()));
    }
    return scenes;
}

RasterSubject golden_subject(const GoldenScene& scene, const RasterMode& mode, RasterJudge judge) {
    const bool needles = has_needles(scene.inputs);
    if (needles && judge == RasterJudge::kFloat32) judge = RasterJudge::kFloat32Needles;
    if (needles && judge == RasterJudge::kFloat64) judge = RasterJudge::kFloat64Needles;
    return {scene.inputs.name + " " + mode.name, judge, scene.fragile, scene.hostile,
            scene.inputs.opacities};
}

}  // namespace splat::test
