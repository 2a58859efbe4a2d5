// The rasterizer, forward and backward, over families of scenes.

#include <random>

#include "stress/raster_bound.h"
#include "stress/raster_run.h"
#include "stress/raster_scenes.h"
#include "stress/stress.h"

namespace vkrun::stress {
namespace {

/// At random, of every pixel and output that has a gradient.
RasterLoss random_loss(const RasterScene& scene) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> weight(-1, 1);
    RasterLoss loss;
    const auto fill = [&](std::vector<double>& to, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) to.push_back(static_cast<double>(weight(random)));
    };
    fill(loss.grad_rgb, 3 * scene.pixels());
    fill(loss.grad_alpha, scene.pixels());
    fill(loss.grad_depth, scene.pixels());
    return loss;
}

void run_scene(Run& run, const RasterStress& stress) {
    const RasterLoss loss = random_loss(stress.scene);
    const auto expected = raster_expected(stress.scene, loss, run.quick() ? 4 : 8);
    const RasterResults<float> published = published_in_float32(stress.scene, loss);
    for (const KernelDevice& with : run.devices())
        run.unless_refused("raster/" + stress.name + ", " + with.kernels, [&] {
            RasterOnDevice on_device(with.device.get(), stress.scene, loss);
            RasterResults<float> first = on_device.results();
            const RasterResults<float> again = on_device.results();
            for (auto& [name, values] : first) {
                Row row{"raster", stress.name, stress.input, name, with.kernels, kRasterReason};
                row.peer = peer_error(published.at(name), expected.at(name));
                run.add(std::move(row), std::move(values), again.at(name), expected.at(name));
            }
        });
}

}  // namespace

void stress_raster(Run& run) {
    for (const RasterStress& stress : raster_families(run.quick()))
        if (run.wants(stress.name)) run_scene(run, stress);
    stress_triangles(run);
}

}  // namespace vkrun::stress
