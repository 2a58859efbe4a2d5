#include "ops/gaussian_head.h"

#include <cmath>

#include "core/checked_math.h"
#include "ops/gaussian_rows.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

constexpr struct {
    const char* name;
    std::uint32_t HeadForm::*value;
    std::uint32_t least, most;
} kHeadBounds[] = {{"sh_degree", &HeadForm::sh_degree, 0, 1},
                   {"positions", &HeadForm::positions, kHeadRayDepth, kHeadBox},
                   {"scales", &HeadForm::scales, kHeadExp, kHeadSoftplus},
                   {"per_pixel", &HeadForm::per_pixel, 1, kMostGaussiansPerPixel}};

Status expect_bounded(const char* name, std::int64_t value, std::uint32_t least,
                      std::uint32_t most) {
    if (value >= least && value <= most) return {};
    return invalid("gaussian_head: %s is %lld, expected %u to %u", name, lld(value), least, most);
}

std::vector<vk::SpecConstant> constants_of(const HeadLayout& layout, std::uint32_t size) {
    std::vector<vk::SpecConstant> constants = {
        {params::kWorkgroupSizeId, size},
        {params::kGaussianHeadPositionsId, layout.positions},
        {params::kGaussianHeadOffsetId, layout.offset ? 1U : 0U},
        {params::kGaussianHeadDegreeId, layout.sh_degree},
        {params::kGaussianHeadDirectId, layout.direct ? 1U : 0U},
        {params::kGaussianHeadPerPixelId, layout.per_pixel},
        {params::kGaussianHeadChannelsId, layout.channels_of_one()},
        {params::kGaussianHeadOpacityActivationId, layout.blocks[kHeadOpacity].activation},
        {params::kGaussianHeadScaleActivationId, layout.blocks[kHeadScale].activation},
        {params::kGaussianHeadColourActivationId, layout.blocks[kHeadColour].activation}};
    for (std::uint32_t block = 0; block < kHeadBlocks; ++block)
        constants.push_back({params::kGaussianHeadDepthAtId + block, layout.at(block)});
    return constants;
}

Status record(vk::Recorder& recorder, const char* kernel, const GaussianHeadDesc& desc,
              const GaussianHeadCameras& cameras, const vk::BufferView& net_out,
              std::vector<vk::Access> rest) {
    SPLAT_TRY(gaussian_head_check(desc));
    const bool focal = cameras.focal.block != nullptr;
    const bool origin = cameras.origin.block != nullptr;
    if (desc.layout.positions == kHeadInputDepth && !origin)
        return invalid(
            "gaussian_head: positions is %u, which needs origin, the depth of each pixel",
            desc.layout.positions);
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
    const std::uint64_t pixels = std::uint64_t{desc.images} * desc.pixels;
    const vk::Groups groups = vk::groups_for(recorder.device(), pixels, size);
    const HeadLayout& layout = desc.layout;
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = constants_of(layout, size),
        .push = params::GaussianHeadParams{desc.images, desc.pixels, layout.least, layout.most,
                                           layout.isotropic ? 1U : 0U, focal ? 1U : 0U,
                                           origin ? 1U : 0U, groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 150.0 * layout.per_pixel * static_cast<double>(pixels),
                 .bytes = 8.0 * desc.channels * static_cast<double>(pixels)},
    });
}

}  // namespace

Status gaussian_head_check(const GaussianHeadDesc& desc) {
    const HeadLayout& layout = desc.layout;
    for (const auto& [name, value, least, most] : kHeadBounds)
        SPLAT_TRY(expect_bounded(name, layout.*value, least, most));
    if (layout.direct && layout.sh_degree > 0)
        return invalid("gaussian_head: sh_degree is %u, expected 0 with direct colours",
                       layout.sh_degree);
    if (!std::isfinite(layout.least) || !std::isfinite(layout.most) || layout.least >= layout.most)
        return invalid(
            "gaussian_head: znear is %g and zfar %g, expected finite numbers, znear < zfar",
            static_cast<double>(layout.least), static_cast<double>(layout.most));
    if (desc.views < 1 || desc.images % desc.views != 0)
        return error(Code::kShape,
                     "gaussian_head: %u images do not divide into objects of %u views", desc.images,
                     desc.views);
    if (desc.channels != layout.channels()) {
        std::string blocks;
        for (const HeadBlock& block : layout.blocks)
            if (block.channels > 0) blocks += format(" %s %u", block.name, block.channels);
        return error(
            Code::kShape,
            "gaussian_head: net_out has %u channels, expected %u, for each of %u Gaussians "
            "of a pixel:%s",
            desc.channels, layout.channels(), layout.per_pixel, blocks.c_str());
    }
    return {};
}

std::vector<JsonScalar> gaussian_head_attributes(const HeadForm& form, std::uint32_t views) {
    return {{"views", std::int64_t{views}},
            {"znear", static_cast<double>(form.least)},
            {"zfar", static_cast<double>(form.most)},
            {"sh_degree", std::int64_t{form.sh_degree}},
            {"offset", form.offset},
            {"isotropic", form.isotropic},
            {"activate", form.activate},
            {"positions", std::int64_t{form.positions}},
            {"scales", std::int64_t{form.scales}},
            {"direct", form.direct},
            {"per_pixel", std::int64_t{form.per_pixel}}};
}

Status gaussian_head_forward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                             const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                             const gaussians::SetViews& set) {
    return record(recorder, "gaussian_head_forward", desc, cameras, net_out,
                  {vk::write(set.gaussians), vk::write(set.colors)});
}

Status gaussian_head_backward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                              const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                              const gaussians::SetViews& grads,
                              const vk::BufferView& grad_net_out) {
    return record(recorder, "gaussian_head_backward", desc, cameras, net_out,
                  {vk::read(grads.gaussians), vk::read(grads.colors), vk::write(grad_net_out)});
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
    {"znear", "number", "0.8", "depth at the network's least value; the box's least coordinate"},
    {"zfar", "number", "1.8",
     "depth at the network's greatest value; the box's greatest coordinate"},
    {"sh_degree", "integer", "1", "degree of the colours' spherical harmonics, 0 or 1"},
    {"offset", "boolean", "true", "three channels move each point off its ray"},
    {"isotropic", "boolean", "false", "the first scale is used for all three"},
    {"activate", "boolean", "true",
     "sigmoid of the opacities, exp or softplus of the scales, tanh of direct colours"},
    {"positions", "integer", "0",
     "0: depth along the ray; 1: that of origin [N, H, W]; 2: in a box of the world, no camera"},
    {"scales", "integer", "2", "2: exp; 3: softplus / 10"},
    {"direct", "boolean", "false",
     "colours are tanh / 2 + 1/2 of channels; sh (colour - 1/2) / C0"},
    {"per_pixel", "integer", "1", "Gaussians of a pixel, 1 to 4, each with channels of its own"},
};

Result<GaussianHeadDesc> head_desc(const Attributes& attributes, const Shape& net_out) {
    SPLAT_TRY(expect_images("gaussian_head", "net_out", net_out));
    GaussianHeadDesc desc;
    desc.images = net_out[0];
    desc.channels = net_out[1];
    desc.pixels = net_out[2] * net_out[3];
    SPLAT_TRY(expect_bounded("views", attributes.integer("views"), 1, desc.images));
    desc.views = static_cast<std::uint32_t>(attributes.integer("views"));
    HeadForm form;
    for (const auto& [name, value, least, most] : kHeadBounds) {
        // What 32 bits do not hold would be another number to gaussian_head_check.
        SPLAT_TRY(expect_bounded(name, attributes.integer(name), least, most));
        form.*value = static_cast<std::uint32_t>(attributes.integer(name));
    }
    form.least = static_cast<float>(attributes.number("znear"));
    form.most = static_cast<float>(attributes.number("zfar"));
    form.offset = attributes.boolean("offset");
    form.isotropic = attributes.boolean("isotropic");
    form.activate = attributes.boolean("activate");
    form.direct = attributes.boolean("direct");
    desc.layout = HeadLayout(form);
    return desc;
}

/// The set of all objects.
gaussians::SetDesc set_of(const GaussianHeadDesc& desc) {
    return {desc.images * desc.pixels * desc.layout.per_pixel, desc.layout.sh_degree};
}

/// Parts of a set begin at multiples of so many bytes, which satisfies every alignment of bindings.
constexpr std::uint64_t kSetAlignment = 256;

std::uint64_t gaussian_bytes(const gaussians::SetDesc& set) {
    return round_up(std::uint64_t{set.gaussians} * gaussians::kGaussianFloats * 4, kSetAlignment);
}

std::uint64_t color_bytes(const gaussians::SetDesc& set) {
    return std::uint64_t{set.gaussians} * set.color_quads() * 16;
}

gaussians::SetViews set_in(const vk::BufferView& workspace, const gaussians::SetDesc& set) {
    return {workspace.part(0, gaussian_bytes(set)),
            workspace.part(gaussian_bytes(set), color_bytes(set)), set.gaussians};
}

Result<OpPlan> gaussian_head_plan(const vk::Recorder&, const Attributes& attributes,
                                  std::span<const Shape> inputs) {
    const Shape& net_out = inputs[0];
    SPLAT_ASSIGN(const GaussianHeadDesc desc, head_desc(attributes, net_out));
    SPLAT_TRY(gaussian_head_check(desc));
    const bool depths = desc.layout.positions == kHeadInputDepth;
    const Shape expected[] = {
        net_out,
        {3, net_out[2], net_out[3]},
        {desc.images, 4, 4},
        {desc.images, 4},
        {desc.images, 2},
        depths ? Shape{desc.images, net_out[2], net_out[3]} : Shape{desc.images}};
    for (std::size_t i = 1; i < inputs.size(); ++i) {
        const bool optional = kGaussianHeadInputs[i].optional && !(depths && i == 5);
        if (!optional || inputs[i].rank() > 0)
            SPLAT_TRY(
                expect_shape("gaussian_head", kGaussianHeadInputs[i].name, inputs[i], expected[i]));
    }
    const std::uint32_t batch = desc.images / desc.views;
    const std::uint32_t each = desc.views * desc.pixels * desc.layout.per_pixel;
    const std::uint64_t bytes = gaussian_bytes(set_of(desc)) + color_bytes(set_of(desc));
    return OpPlan{
        .outputs = {Shape{batch, each, 3}, Shape{batch, each, 1}, Shape{batch, each, 3},
                    Shape{batch, each, 4}, Shape{batch, each, desc.layout.coefficients(), 3}},
        .forward_workspace = bytes,
        .backward_workspace = bytes};
}

GaussianHeadCameras cameras_of(const OpViews& v) {
    return {v.inputs[1], v.inputs[2], v.inputs[3], v.inputs[4], v.inputs[5]};
}

GaussianRows rows_of(const std::vector<vk::BufferView>& views) {
    return {.means = views[0],
            .scales = views[2],
            .rotations = views[3],
            .opacities = views[1],
            .colors = views[4]};
}

Status gaussian_head_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                                 const OpViews& v) {
    SPLAT_ASSIGN(const GaussianHeadDesc desc, head_desc(attributes, v.inputs[0].shape));
    const gaussians::SetViews set = set_in(v.workspace, set_of(desc));
    SPLAT_TRY(gaussian_head_forward(recorder, desc, v.inputs[0], cameras_of(v), set));
    return unpack_rows(recorder, set_of(desc), set, rows_of(v.outputs), false);
}

Status gaussian_head_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                                  const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const GaussianHeadDesc desc, head_desc(attributes, v.inputs[0].shape));
    const gaussians::SetViews grads = set_in(v.workspace, set_of(desc));
    SPLAT_TRY(pack_rows(recorder, set_of(desc), rows_of(v.grad_outputs), grads));
    return gaussian_head_backward(recorder, desc, v.inputs[0], cameras_of(v), grads,
                                  v.grad_inputs[0]);
}

constexpr Port kGaussianSetOutputs[] = {{"gaussians", Layout::kRowMajor},
                                        {"colors", Layout::kRowMajor}};

Result<OpPlan> gaussian_set_plan(const vk::Recorder& recorder, const Attributes& attributes,
                                 std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const OpPlan rows, gaussian_head_plan(recorder, attributes, inputs));
    SPLAT_ASSIGN(const GaussianHeadDesc desc, head_desc(attributes, inputs[0]));
    const std::uint32_t batch = rows.outputs[0][0];
    const std::uint32_t each = rows.outputs[0][1];
    return OpPlan{.outputs = {Shape{batch, each, gaussians::kGaussianFloats},
                              Shape{batch, each, 4 * set_of(desc).color_quads()}}};
}

Status gaussian_set_forward(vk::Recorder& recorder, const Attributes& attributes,
                            const OpViews& v) {
    SPLAT_ASSIGN(const GaussianHeadDesc desc, head_desc(attributes, v.inputs[0].shape));
    return gaussian_head_forward(recorder, desc, v.inputs[0], cameras_of(v),
                                 {v.outputs[0], v.outputs[1]});
}

Status gaussian_set_backward(vk::Recorder& recorder, const Attributes& attributes,
                             const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const GaussianHeadDesc desc, head_desc(attributes, v.inputs[0].shape));
    return gaussian_head_backward(recorder, desc, v.inputs[0], cameras_of(v),
                                  {v.grad_outputs[0], v.grad_outputs[1]}, v.grad_inputs[0]);
}

}  // namespace

const OpRow kGaussianHeadRow = {
    .name = "gaussian_head",
    .equation =
        "Gaussians of each pixel: means = ([ray * (sigmoid(d) * (zfar - znear) + znear + origin) + "
        "offset, 1] view_to_world).xyz / w, sigmoid, exp, quaternion * q / |q|, sh turned",
    .inputs = kGaussianHeadInputs,
    .outputs = kGaussianHeadOutputs,
    .attributes = kGaussianHeadAttributes,
    .plan = gaussian_head_plan,
    .forward = gaussian_head_row_forward,
    .backward = gaussian_head_row_backward};

const OpRow& gaussian_set_row() {
    static const OpRow row = [] {
        OpRow made = kGaussianHeadRow;
        made.outputs = kGaussianSetOutputs;
        made.plan = gaussian_set_plan;
        made.forward = gaussian_set_forward;
        made.backward = gaussian_set_backward;
        return made;
    }();
    return row;
}

}  // namespace splat::ops
