#include "ops/gaussian_head.h"

#include <cmath>

#include "params/gaussian_head_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* kernel, const GaussianHeadDesc& desc,
              const GaussianHeadCameras& cameras, const vk::BufferView& net_out,
              std::vector<vk::Access> rest) {
    SPLAT_TRY(gaussian_head_check(desc));
    const bool focal = cameras.focal.block != nullptr;
    const bool origin = cameras.origin.block != nullptr;
    std::vector<vk::Access> accesses = {
        vk::read(net_out),
        vk::read(cameras.rays),
        vk::read(cameras.view_to_world),
        vk::read(cameras.quaternion),
        vk::read(focal ? cameras.focal : cameras.quaternion),
        vk::read(origin ? cameras.origin : cameras.quaternion),
    };
    accesses.insert(accesses.end(), rest.begin(), rest.end());
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const std::uint64_t gaussians = std::uint64_t{desc.images} * desc.pixels;
    const vk::Groups groups = vk::groups_for(recorder.device(), gaussians, size);
    const double count = static_cast<double>(gaussians);
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size},
                      {params::kGaussianHeadOffsetId, desc.offset ? 1U : 0U},
                      {params::kGaussianHeadDegreeId, desc.sh_degree}},
        .push =
            params::GaussianHeadParams{desc.images, desc.pixels, desc.znear, desc.zfar - desc.znear,
                                       desc.isotropic ? 1U : 0U, desc.activate ? 1U : 0U,
                                       focal ? 1U : 0U, origin ? 1U : 0U, groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 150 * count, .bytes = 8.0 * desc.channels * count},
    });
}

}  // namespace

std::uint32_t gaussian_head_channels(const GaussianHeadDesc& desc) {
    return 12 + (desc.offset ? 3U : 0U) + 9 * desc.sh_degree;
}

Status gaussian_head_check(const GaussianHeadDesc& desc) {
    if (desc.sh_degree > 1)
        return error(Code::kInvalidArgument, "gaussian_head: sh_degree is %u, expected 0 or 1",
                     desc.sh_degree);
    if (!std::isfinite(desc.znear) || !std::isfinite(desc.zfar) || desc.znear >= desc.zfar)
        return error(
            Code::kInvalidArgument,
            "gaussian_head: znear is %g and zfar %g, expected finite numbers, znear < zfar",
            static_cast<double>(desc.znear), static_cast<double>(desc.zfar));
    if (desc.views < 1 || desc.images % desc.views != 0)
        return error(Code::kShape,
                     "gaussian_head: %u images do not divide into objects of %u views", desc.images,
                     desc.views);
    if (desc.channels != gaussian_head_channels(desc))
        return error(
            Code::kShape,
            "gaussian_head: net_out has %u channels, expected %u for sh_degree %u %s offset",
            desc.channels, gaussian_head_channels(desc), desc.sh_degree,
            desc.offset ? "with" : "without");
    return {};
}

Status gaussian_head_forward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                             const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                             const GaussianHeadTensors& gaussians) {
    return record(
        recorder, "gaussian_head_forward", desc, cameras, net_out,
        {vk::write(gaussians.means), vk::write(gaussians.opacities), vk::write(gaussians.scales),
         vk::write(gaussians.rotations), vk::write(gaussians.sh)});
}

Status gaussian_head_backward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                              const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                              const GaussianHeadTensors& grads,
                              const vk::BufferView& grad_net_out) {
    return record(recorder, "gaussian_head_backward", desc, cameras, net_out,
                  {vk::read(grads.means), vk::read(grads.opacities), vk::read(grads.scales),
                   vk::read(grads.rotations), vk::read(grads.sh), vk::write(grad_net_out)});
}

namespace {

constexpr Port kGaussianHeadInputs[] = {{"net_out"},
                                        {"rays", Layout::kRowMajor, false, true},
                                        {"view_to_world", Layout::kRowMajor, false, true},
                                        {"quaternion", Layout::kRowMajor, false, true},
                                        {"focal", Layout::kRowMajor, true, true},
                                        {"origin", Layout::kRowMajor, true, true}};
constexpr Port kGaussianHeadOutputs[] = {{"means", Layout::kRowMajor},
                                         {"opacities", Layout::kRowMajor},
                                         {"scales", Layout::kRowMajor},
                                         {"rotations", Layout::kRowMajor},
                                         {"sh", Layout::kRowMajor}};
constexpr Attribute kGaussianHeadAttributes[] = {
    {"views", "integer", "1", "images of one object; divides the images"},
    {"znear", "number", "0.8", "depth at the network's least value"},
    {"zfar", "number", "1.8", "depth at the network's greatest value"},
    {"sh_degree", "integer", "1", "degree of the colours' spherical harmonics, 0 or 1"},
    {"offset", "boolean", "true", "channels 1 to 3 move each point off its ray"},
    {"isotropic", "boolean", "false", "the first scale is used for all three"},
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

Result<GaussianHeadDesc> head_desc(const Attributes& attributes, const Shape& net_out) {
    if (net_out.rank() != 4)
        return error(Code::kShape,
                     "gaussian_head: tensor 'net_out' has shape %s, expected [N, C, H, W]",
                     net_out.text().c_str());
    GaussianHeadDesc desc;
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

Result<OpPlan> gaussian_head_plan(const vk::Recorder&, const Attributes& attributes,
                                  std::span<const Shape> inputs) {
    const Shape& net_out = inputs[0];
    SPLAT_ASSIGN(const GaussianHeadDesc desc, head_desc(attributes, net_out));
    SPLAT_TRY(gaussian_head_check(desc));
    const Shape expected[] = {net_out,
                              {3, net_out[2], net_out[3]},
                              {desc.images, 4, 4},
                              {desc.images, 4},
                              {desc.images, 2},
                              {desc.images}};
    for (std::size_t i = 1; i < inputs.size(); ++i)
        if (!kGaussianHeadInputs[i].optional || inputs[i].rank() > 0)
            SPLAT_TRY(
                expect_shape("gaussian_head", kGaussianHeadInputs[i].name, inputs[i], expected[i]));
    const std::uint32_t batch = desc.images / desc.views;
    const std::uint32_t each = desc.views * desc.pixels;
    return OpPlan{.outputs = {Shape{batch, each, 3}, Shape{batch, each, 1}, Shape{batch, each, 3},
                              Shape{batch, each, 4},
                              Shape{batch, each, 1 + 3 * desc.sh_degree, 3}}};
}

GaussianHeadCameras cameras_of(const OpViews& v) {
    return {v.inputs[1], v.inputs[2], v.inputs[3], v.inputs[4], v.inputs[5]};
}

GaussianHeadTensors tensors_of(const std::vector<vk::BufferView>& views) {
    return {views[0], views[1], views[2], views[3], views[4]};
}

Status gaussian_head_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                                 const OpViews& v) {
    SPLAT_ASSIGN(const GaussianHeadDesc desc, head_desc(attributes, v.inputs[0].shape));
    return gaussian_head_forward(recorder, desc, v.inputs[0], cameras_of(v), tensors_of(v.outputs));
}

Status gaussian_head_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                                  const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const GaussianHeadDesc desc, head_desc(attributes, v.inputs[0].shape));
    return gaussian_head_backward(recorder, desc, v.inputs[0], cameras_of(v),
                                  tensors_of(v.grad_outputs), v.grad_inputs[0]);
}

}  // namespace

const OpRow kGaussianHeadRow = {
    .name = "gaussian_head",
    .equation =
        "one Gaussian per pixel: means = ([ray * (sigmoid(d) * (zfar - znear) + znear + origin) + "
        "offset, 1] view_to_world).xyz / w, sigmoid, exp, quaternion * q / |q|, sh turned",
    .inputs = kGaussianHeadInputs,
    .outputs = kGaussianHeadOutputs,
    .attributes = kGaussianHeadAttributes,
    .plan = gaussian_head_plan,
    .forward = gaussian_head_row_forward,
    .backward = gaussian_head_row_backward};

}  // namespace splat::ops
