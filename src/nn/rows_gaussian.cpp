#include "nn/op_rows.h"
#include "ops/gaussian_head.h"

namespace splat::nn {
namespace {

using vk::BufferView;

constexpr Port kHeadInputs[] = {{"net_out"},
                                {"rays", Layout::kRowMajor, false, true},
                                {"view_to_world", Layout::kRowMajor, false, true},
                                {"quaternion", Layout::kRowMajor, false, true},
                                {"focal", Layout::kRowMajor, true, true},
                                {"distance", Layout::kRowMajor, true, true}};
constexpr Port kHeadOutputs[] = {{"means", Layout::kRowMajor},
                                 {"opacities", Layout::kRowMajor},
                                 {"scales", Layout::kRowMajor},
                                 {"rotations", Layout::kRowMajor},
                                 {"sh", Layout::kRowMajor}};
constexpr Attribute kHeadAttributes[] = {
    {"views", "integer", "1", "images per object, whose Gaussians are put together"},
    {"znear", "number", "0.8", "depth of the channel's lower end, scene units"},
    {"zfar", "number", "1.8", "depth of its upper end"},
    {"sh_degree", "integer", "1", "0 or 1"},
    {"offset", "boolean", "true", "channels 1 to 3 are an offset of the mean"},
    {"isotropic", "boolean", "false", "the first scale for all three axes"},
    {"activate", "boolean", "true", "false: opacities as logits and scales as logarithms"},
    {"sh_transform", "boolean", "true", "turn coefficients of degree 1 into the world"},
};

Result<ops::GaussianHeadDesc> head_desc(const Attributes& attributes, const Shape& net_out,
                                        bool focals, bool distances) {
    if (net_out.rank() != 4)
        return error(Code::kShape,
                     "gaussian_head: tensor 'net_out' has shape %s, expected [B*V, C, H, W]",
                     net_out.text().c_str());
    const auto degree = attributes.integer("sh_degree");
    if (degree < 0 || degree > 1)
        return error(Code::kInvalidArgument, "gaussian_head: sh_degree is %lld, expected 0 or 1",
                     static_cast<long long>(degree));
    const auto views = attributes.integer("views");
    if (views < 1 || net_out[0] % views != 0)
        return error(Code::kInvalidArgument,
                     "gaussian_head: views is %lld, expected a divisor of the %u images",
                     static_cast<long long>(views), net_out[0]);
    ops::GaussianHeadDesc desc;
    desc.images = net_out[0];
    desc.pixels = net_out[2] * net_out[3];
    desc.sh_degree = static_cast<std::uint32_t>(degree);
    desc.offset = attributes.boolean("offset");
    desc.isotropic = attributes.boolean("isotropic");
    desc.activate = attributes.boolean("activate");
    desc.sh_transform = attributes.boolean("sh_transform");
    desc.focals = focals;
    desc.distances = distances;
    desc.znear = static_cast<float>(attributes.number("znear"));
    desc.zfar = static_cast<float>(attributes.number("zfar"));
    return desc;
}

Result<OpPlan> head_plan(const vk::Recorder&, const Attributes& attributes,
                         std::span<const Shape> inputs) {
    const Shape& net = inputs[0];
    const bool focals = inputs[4].rank() > 0;
    const bool distances = inputs[5].rank() > 0;
    SPLAT_ASSIGN(const ops::GaussianHeadDesc desc, head_desc(attributes, net, focals, distances));
    SPLAT_TRY(ops::gaussian_head_check(desc));
    const auto expect = [&](std::size_t i, const Shape& shape) {
        return expect_shape("gaussian_head", kHeadInputs[i].name, inputs[i], shape);
    };
    SPLAT_TRY(expect(0, {net[0], ops::gaussian_head_channels(desc), net[2], net[3]}));
    SPLAT_TRY(expect(1, {3, net[2], net[3]}));
    SPLAT_TRY(expect(2, {net[0], 4, 4}));
    SPLAT_TRY(expect(3, {net[0], 4}));
    if (focals) SPLAT_TRY(expect(4, {net[0], 2}));
    if (distances) SPLAT_TRY(expect(5, {net[0], net[2], net[3]}));
    const auto views = static_cast<std::uint32_t>(attributes.integer("views"));
    const std::uint32_t objects = net[0] / views;
    const std::uint32_t count = views * desc.pixels;
    OpPlan plan;
    plan.outputs = {{objects, count, 3},
                    {objects, count, 1},
                    {objects, count, 3},
                    {objects, count, 4},
                    {objects, count, desc.sh_degree == 0 ? 1U : 4U, 3}};
    return plan;
}

ops::GaussianHeadCameras cameras_of(const OpViews& v) {
    const BufferView& rays = v.inputs[1];
    return {rays, v.inputs[2], v.inputs[3], present(v.inputs[4]) ? v.inputs[4] : rays,
            present(v.inputs[5]) ? v.inputs[5] : rays};
}

Status head_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(
        const ops::GaussianHeadDesc desc,
        head_desc(attributes, v.inputs[0].shape, present(v.inputs[4]), present(v.inputs[5])));
    const std::vector<BufferView>& out = v.outputs;
    return ops::gaussian_head_forward(recorder, desc, v.inputs[0], cameras_of(v),
                                      {out[0], out[1], out[2], out[3], out[4]});
}

Status head_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(
        const ops::GaussianHeadDesc desc,
        head_desc(attributes, v.inputs[0].shape, present(v.inputs[4]), present(v.inputs[5])));
    const std::vector<BufferView>& grads = v.grad_outputs;
    return ops::gaussian_head_backward(recorder, desc, v.inputs[0], cameras_of(v),
                                       {grads[0], grads[1], grads[2], grads[3], grads[4]},
                                       v.grad_inputs[0]);
}

}  // namespace

const OpRow kGaussianHeadRow = {
    .name = "gaussian_head",
    .equation =
        "one Gaussian per pixel: depth along its ray, offset, opacity, scales, rotation, sh",
    .inputs = kHeadInputs,
    .outputs = kHeadOutputs,
    .saved = {},
    .attributes = kHeadAttributes,
    .plan = head_plan,
    .prepare = nullptr,
    .forward = head_forward,
    .backward = head_backward};

}  // namespace splat::nn
