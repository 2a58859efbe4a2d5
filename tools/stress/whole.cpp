#include "stress/whole.h"

#include <cmath>

#include "stress/net_bound.h"
#include "stress/network_run.h"
#include "stress/raster_run.h"
#include "stress/whole_step.h"
#include "vkrun/doctor/op_case.h"

namespace vkrun::stress {
namespace {

/// The loss, then the gradients of all parameters.
std::vector<Numbers> in_double(const WholeStep& step, NetNoise* noise) {
    WholeInDouble whole(step);
    std::vector<Numbers> results = {{whole.forward(noise)}};
    whole.backward(noise);
    for (const std::size_t p : step.net.parameters()) results.push_back(whole.net.gradients[p]);
    return results;
}

/// The loss where every parameter has moved by `distance` along `direction`.
double loss_at(const WholeStep& step, const std::vector<Numbers>& direction, double distance) {
    WholeInDouble whole(step);
    const std::vector<std::size_t> parameters = step.net.parameters();
    for (std::size_t t = 0; t < parameters.size(); ++t)
        for (std::size_t i = 0; i < direction[t].size(); ++i)
            whole.net.values[parameters[t]][i] += distance * direction[t][i];
    return whole.forward(nullptr);
}

/// Gradients in float64 against central differences, along random directions.
void check_gradient(Run& run, const WholeStep& step, const std::vector<Numbers>& exact) {
    // Small enough that hardly any Gaussian crosses the threshold of 1/255 in a pixel, where the loss jumps.
    constexpr double kStep = 1e-8;
    NetNoise random(9);
    Verdict worst;
    for (int trial = 0; trial < 4; ++trial) {
        std::vector<Numbers> direction(exact.begin() + 1, exact.end());
        double along = 0;
        double size = 0;
        for (std::size_t t = 0; t < direction.size(); ++t)
            for (std::size_t i = 0; i < direction[t].size(); ++i) {
                direction[t][i] = random.unit();
                along += direction[t][i] * exact[t + 1][i];
                size += std::abs(direction[t][i] * exact[t + 1][i]);
            }
        const auto slope = [&](double h) {
            return (loss_at(step, direction, h) - loss_at(step, direction, -h)) / (2 * h);
        };
        const double wide = slope(2 * kStep);
        const double narrow = slope(kStep);
        Verdict verdict;
        verdict.elements = 1;
        verdict.error = std::abs(narrow - along) / size;
        // The error of the wider difference is four times that of the narrower one.
        verdict.allowed =
            (4 * std::abs(wide - narrow) + 1e4 * 0x1p-53 * std::abs(exact[0][0]) / kStep) / size;
        if (!std::isfinite(verdict.error)) verdict.non_finite = 1;
        if (verdict.error > verdict.allowed) verdict.wrong = 1;
        if (run.options().fault != Fault::kNone) verdict.wrong = 1;
        if (trial == 0 || verdict.ratio() > worst.ratio()) worst = verdict;
    }
    Row row{"train",
            step.name,
            step.input,
            "gradient in float64",
            "float64",
            "4 x the change of the central difference from step 2e-8 to 1e-8, and 1e4 roundings of "
            "float64 of the "
            "loss"};
    row.verdict = worst;
    run.add(std::move(row));
}

std::vector<std::vector<float>> on_device(splat_device device, const WholeStep& step) {
    NetworkOnDevice net(device, step.net);
    net.forward();
    std::vector<Numbers> head;
    for (const std::size_t output : step.outputs) {
        const std::vector<float> values = net.value(output);
        head.emplace_back(values.begin(), values.end());
    }
    const RasterScene scene = scene_of(step, head);
    RasterLoss weights;  // rgb's are written later
    weights.grad_rgb.assign(3 * scene.pixels(), 0);
    weights.grad_alpha.assign(scene.pixels(), 0);
    weights.grad_depth.assign(scene.pixels(), 0);
    OpCase loss;
    loss.op = step.loss;
    loss.attributes = Json::object();
    const std::vector<std::int64_t> dims{1, 3, static_cast<std::int64_t>(scene.camera.height),
                                         static_cast<std::int64_t>(scene.camera.width)};
    RasterOnDevice drawn(device, scene, {});
    drawn.forward();
    loss.inputs = {{"a", dims, planes_of(drawn.output(SPLAT_OUTPUT_RGB, 3 * scene.pixels()))},
                   {"b", dims, step.target, true}};
    loss.outputs = {{"loss", {1}, {1}}};
    CaseOnDevice compared(device, loss);
    compared.forward();
    compared.backward();
    const std::vector<float> grad_rgb = pixels_of(compared.grad_input(0));
    weights.grad_rgb.assign(grad_rgb.begin(), grad_rgb.end());
    RasterOnDevice raster(device, scene, weights);
    raster.forward();
    raster.backward();
    const char* const names[] = {"means", "opacities", "scales", "rotations", "sh"};
    for (std::size_t i = 0; i < step.outputs.size(); ++i)
        net.set_gradient(step.outputs[i], read_tensor(raster.gradient(names[i])));
    net.backward();
    std::vector<std::vector<float>> gradients;
    for (const std::size_t p : step.net.parameters()) gradients.push_back(net.gradient(p));
    return {compared.output(0), joined(gradients)};
}

void run_step(Run& run, const WholeStep& step) {
    check_gradient(run, step, in_double(step, nullptr));
    std::vector<Expected> expected = expected_by_noise(
        [&](NetNoise* noise) { return in_double(step, noise); }, run.quick() ? 4 : 8);
    expected = {expected[0], joined(std::vector<Expected>(expected.begin() + 1, expected.end()))};
    for (const KernelDevice& with : run.devices()) {
        auto first = on_device(with.device.get(), step);
        const auto again = on_device(with.device.get(), step);
        const char* const names[] = {"loss", "grad_parameters"};
        for (std::size_t i = 0; i < first.size(); ++i)
            run.add({"train", step.name, step.input, names[i], with.kernels,
                     std::string(kNetReason) + ", and projected numbers, pixels by 16 roundings"},
                    std::move(first[i]), again[i], expected[i]);
    }
}

}  // namespace

void stress_whole(Run& run) {
    for (const WholeStep& step : whole_steps())
        if (run.wants(step.name)) run_step(run, step);
}

}  // namespace vkrun::stress
