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
                                {"origin", Layout::kRowMajor, true, true}};
constexpr Port kHeadOutputs[] = {{"means", Layout::kRowMajor},
                                 {"opacities", Layout::kRowMajor},
                                 {"scales", Layout::kRowMajor},
                                 {"rotations", Layout::kRowMajor},
                                 {"sh", Layout::kRowMajor}};
constexpr Attribute kHeadAttributes[] = {
    {"views", "integer", "1", "images of one object; divides the images"},
    {"znear", "number", "0.8", "depth that the network's least value stands for"},
    {"zfar", "number", "1.8", "depth that its greatest value stands for"},
    {"sh_degree", "integer", "1", "degree of the colours' spherical harmonics, 0 or 1"},
    {"offset", "boolean", "true", "channels 1 to 3 move each point off its ray"},
    {"isotropic", "boolean", "false", "the first scale is all three"},
    {"activate", "boolean", "true", "sigmoid of the opacities and exp of the scales"},
};

Result<std::uint32_t> bounded(const Attributes& attributes, const char* name, std::int64_t least,
                              std::int64_t most) {
    const std::int64_t value = attributes.integer(name);
    if (value < least || value > most)
        return error(Code::kInvalidArgument, "gaussian_head: %s is %lld, expected %lld to %lld",
                     name, static_cast<long long>(value), static_cast<long long>(least),
                     static_cast<long long>(most));
    return static_cast<std::uint32_t>(value);
}

Result<ops::GaussianHeadDesc> head_desc(const Attributes& attributes, const Shape& net_out) {
    if (net_out.rank() != 4)
        return error(Code::kShape,
                     "gaussian_head: tensor 'net_out' has shape %s, expected [N, C, H, W]",
                     net_out.text().c_str());
    ops::GaussianHeadDesc desc;
    desc.images = net_out[0];
    desc.channels = net_out[1];
    desc.pixels = net_out[2] * net_out[3];
    SPLAT_ASSIGN(desc.views, bounded(attributes, "views", 1, desc.images));
    SPLAT_ASSIGN(desc.sh_degree, bounded(attributes, "sh_degree", 0, 1));
    desc.znear = static_cast<float>(attributes.number("znear"));
    desc.zfar = static_cast<float>(attributes.number("zfar"));
    desc.offset = attributes.boolean("offset");
    desc.isotropic = attributes.boolean("isotropic");
    desc.activate = attributes.boolean("activate");
    return desc;
}

Result<OpPlan> head_plan(const vk::Recorder&, const Attributes& attributes,
                         std::span<const Shape> inputs) {
    const Shape& net_out = inputs[0];
    SPLAT_ASSIGN(const ops::GaussianHeadDesc desc, head_desc(attributes, net_out));
    SPLAT_TRY(ops::gaussian_head_check(desc));
    const Shape expected[] = {net_out,
                              {3, net_out[2], net_out[3]},
                              {desc.images, 4, 4},
                              {desc.images, 4},
                              {desc.images, 2},
                              {desc.images}};
    for (std::size_t i = 1; i < inputs.size(); ++i)
        if (!kHeadInputs[i].optional || inputs[i].rank() > 0)
            SPLAT_TRY(expect_shape("gaussian_head", kHeadInputs[i].name, inputs[i], expected[i]));
    const std::uint32_t batch = desc.images / desc.views;
    const std::uint32_t each = desc.views * desc.pixels;
    OpPlan plan;
    plan.outputs = {{batch, each, 3},
                    {batch, each, 1},
                    {batch, each, 3},
                    {batch, each, 4},
                    {batch, each, 1 + 3 * desc.sh_degree, 3}};
    return plan;
}

ops::GaussianHeadCameras head_cameras(const OpViews& v) {
    return {v.inputs[1], v.inputs[2], v.inputs[3], v.inputs[4], v.inputs[5]};
}

ops::GaussianHeadTensors head_tensors(const std::vector<BufferView>& views) {
    return {views[0], views[1], views[2], views[3], views[4]};
}

Status head_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::GaussianHeadDesc desc, head_desc(attributes, v.inputs[0].shape));
    return ops::gaussian_head_forward(recorder, desc, v.inputs[0], head_cameras(v),
                                      head_tensors(v.outputs));
}

Status head_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::GaussianHeadDesc desc, head_desc(attributes, v.inputs[0].shape));
    return ops::gaussian_head_backward(recorder, desc, v.inputs[0], head_cameras(v),
                                       head_tensors(v.grad_outputs), v.grad_inputs[0]);
}

}  // namespace

const OpRow kGaussianHeadRow = {
    .name = "gaussian_head",
    .equation =
        "one Gaussian per pixel: means = ([ray * (sigmoid(d) * (zfar - znear) + znear + origin) + "
        "offset, 1] view_to_world).xyz / w, sigmoid, exp, quaternion * q / |q|, sh turned",
    .inputs = kHeadInputs,
    .outputs = kHeadOutputs,
    .saved = {},
    .attributes = kHeadAttributes,
    .plan = head_plan,
    .prepare = nullptr,
    .forward = head_forward,
    .backward = head_backward};

}  // namespace splat::nn
