#include "stress/whole_step.h"

#include <cmath>

#include "ref/op_ref.h"
#include "vkrun/doctor/op_case.h"

namespace vkrun::stress {
namespace {

namespace ref = splat::ref;

constexpr std::size_t kNetSide = 6;      ///< side of the network's images
constexpr std::size_t kImageWidth = 24;  ///< size of the drawn image
constexpr std::size_t kImageHeight = 18;

WholeStep make_step(const std::string& name, const std::string& loss, ref::Convention convention,
                    bool antialiased, std::size_t degree, bool offset) {
    WholeStep step;
    step.name = "whole/" + name;
    step.loss = loss;
    step.input = "network, head, rasterizer and " + loss + ": a complete step";
    Network& net = step.net;
    const std::size_t channels = 12 + 9 * degree + (offset ? 3 : 0);
    const std::size_t x = net.give("x", {1, 3, kNetSide, kNetSide}, Role::kInput, 0.5, 0.25);
    const std::size_t hidden = add_norm(net, add_conv(net, x, 8, 3), 2);
    const std::size_t raw = add_conv(net, hidden, channels, 3);
    for (const std::size_t p : net.parameters())  // Gaussians of a few pixels
        if (net.tensors[p].dims == std::vector<std::size_t>{channels})
            for (std::size_t k = 0; k < 3; ++k) net.tensors[p].values[(offset ? 5 : 2) + k] = -2.5F;
    const std::size_t rays = net.give("rays", {3, kNetSide, kNetSide}, Role::kConstant, 0, 1);
    std::vector<float>& ray = net.tensors[rays].values;
    for (std::size_t i = 0; i < kNetSide * kNetSide; ++i) {
        ray[i] = (static_cast<float>(i % kNetSide) + 0.5F) / kNetSide - 0.5F;
        ray[kNetSide * kNetSide + i] = (static_cast<float>(i / kNetSide) + 0.5F) / kNetSide - 0.5F;
        ray[2 * kNetSide * kNetSide + i] = 1;
    }
    const std::size_t pose = net.give("view_to_world", {1, 4, 4}, Role::kConstant, 0, 0);
    for (const std::size_t i : {0U, 5U, 10U, 15U}) net.tensors[pose].values[i] = 1;
    const std::size_t turn = net.give("quaternion", {1, 4}, Role::kConstant, 0, 0);
    net.tensors[turn].values[0] = 1;
    const std::size_t none = net.give("none", {}, Role::kConstant, 0, 0);
    net.tensors[none].values.clear();
    constexpr std::size_t kCount = kNetSide * kNetSide;
    step.outputs = net.add_several("gaussian_head",
                                   {{"views", 1},
                                    {"sh_degree", degree},
                                    {"offset", offset},
                                    {"activate", true},
                                    {"znear", 1},
                                    {"zfar", 2}},
                                   {raw, rays, pose, turn, none, none},
                                   {{1, kCount, 3},
                                    {1, kCount, 1},
                                    {1, kCount, 3},
                                    {1, kCount, 4},
                                    {1, kCount, 1 + 3 * degree, 3}});
    step.scene.camera = {22,
                         22,
                         kImageWidth / 2.0,
                         kImageHeight / 2.0,
                         kImageWidth,
                         kImageHeight,
                         step.scene.camera.world_to_camera};
    step.scene.options = ref::raster_options<double>(convention, antialiased);
    step.scene.background = {0.25, 0.5, 0.75};
    step.scene.sh_coefficients = 1 + 3 * degree;
    step.target = filled("target", {1, 3, kImageHeight, kImageWidth}, 55, 0.5, 0.25).values;
    return step;
}

}  // namespace

std::vector<WholeStep> whole_steps() {
    return {make_step("3dgs_l2", "l2", ref::Convention::k3dgs, false, 0, true),
            make_step("gsplat_l1", "l1", ref::Convention::kGsplat, true, 1, true),
            make_step("3dgs_ssim", "ssim", ref::Convention::k3dgs, false, 1, false)};
}

RasterScene scene_of(const WholeStep& step, const std::vector<Numbers>& head) {
    RasterScene scene = step.scene;
    scene.means = head[0];
    scene.opacities = head[1];
    scene.scales = head[2];
    scene.rotations = head[3];
    scene.sh = head[4];
    return scene;
}

ref::OpArguments WholeInDouble::loss_arguments() const {
    const std::vector<std::size_t> dims{1, 3, kImageHeight, kImageWidth};
    return {{{dims, planes_of(rgb_)}, {dims, {step_.target.begin(), step_.target.end()}}},
            attributes_of(step_.loss, Json::object())};
}

double WholeInDouble::forward(NetNoise* noise) {
    net.forward(noise);
    std::vector<Numbers> head;
    for (const std::size_t output : step_.outputs) head.push_back(net.values[output]);
    scene_ = scene_of(step_, head);
    projected_ = ref::project_forward(scene_);
    if (noise != nullptr)  // the noise of raster_expected()
        for (const std::uint32_t i : projected_.order) {
            auto& g = projected_.gaussians[i];
            const auto move = [&](double& number) { number *= 1 + 16 * kRounding * noise->unit(); };
            for (double& number : g.mean2d) move(number);
            for (double& number : g.color) move(number);
            move(g.opacity);
        }
    rgb_ = ref::blend_forward(scene_, projected_).rgb;
    if (noise != nullptr)
        for (double& number : rgb_) number *= 1 + 16 * kRounding * noise->unit();
    const auto sums = ref::find_op(step_.loss)->forward(loss_arguments());
    return noise != nullptr ? noise->moved(sums[0], 1)[0] : sums[0].value[0];
}

void WholeInDouble::backward(NetNoise* noise) {
    const auto sums = ref::find_op(step_.loss)->backward(loss_arguments(), {{1}});
    ref::RasterLoss<double> weights;
    weights.grad_rgb = pixels_of(noise != nullptr ? noise->moved(sums[0], 1) : sums[0].value);
    const auto back =
        ref::project_backward(scene_, projected_, ref::blend_backward(scene_, projected_, weights));
    const Numbers* const gradients[] = {&back.grad_means, &back.grad_opacities, &back.grad_scales,
                                        &back.grad_rotations, &back.grad_sh};
    for (std::size_t i = 0; i < step_.outputs.size(); ++i)
        net.gradients[step_.outputs[i]] = *gradients[i];
    net.backward(noise);
}

}  // namespace vkrun::stress
