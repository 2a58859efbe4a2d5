#include "ops/images/resample2d.h"

#include <algorithm>

#include "core/checked_math.h"
#include "params/images_params.h"

namespace splat::ops {
namespace {

constexpr std::uint32_t kMaxTaps = 16;

/// One dispatch from an image of height x width.
Status record(vk::Recorder& recorder, const char* kernel, const Resample2dDesc& desc, bool up,
              std::uint32_t height, std::uint32_t width, std::vector<vk::Access> accesses) {
    const std::uint32_t planes = (desc.c + 3) / 4 * desc.n;
    const std::uint64_t in = std::uint64_t{planes} * height * width;
    const std::uint64_t out = up ? 4 * in : in / 4;
    const double taps = std::max(2U, desc.taps);
    return record_each(
        recorder,
        {.kernel = kernel,
         .items = out,
         .accesses = std::move(accesses),
         .work = {.flops = 8.0 * taps * taps * static_cast<double>(std::min(in, out)),
                  .bytes = 16.0 * static_cast<double>(in + out)},
         .constants = {{params::kResample2dBoxId, desc.taps == 0 ? 1U : 0U},
                       {params::kResample2dUpId, up ? 1U : 0U}}},
        [&](std::uint32_t groups_x) {
            params::Resample2dParams params{};
            params.planes = planes;
            params.height = height;
            params.width = width;
            params.taps = desc.taps;
            params.gain = desc.up ? 4.0F : 1.0F;
            params.groups_x = groups_x;
            return params;
        });
}

}  // namespace

Status resample2d_check(const Resample2dDesc& desc) {
    if (!desc.up && (desc.height % 2 != 0 || desc.width % 2 != 0))
        return error(Code::kShape,
                     "resample2d: an image of %u x %u does not halve; expected even sizes",
                     desc.height, desc.width);
    if (desc.taps % 2 != 0 || desc.taps > kMaxTaps)
        return invalid("resample2d: a filter of %u taps, expected an even number up to %u",
                       desc.taps, kMaxTaps);
    const auto pixels = checked_mul(std::uint64_t{desc.height} * desc.width,
                                    round_up(desc.c, 4) * desc.n * (desc.up ? 4U : 1U));
    if (!pixels || *pixels > kMaxElements)
        return unsupported("resample2d: [%u, %u, %u, %u] or its result has 2^31 elements or more",
                           desc.n, desc.c, desc.height, desc.width);
    return {};
}

namespace {

constexpr Port kResample2dInputs[] = {{"x"}, {"filter", Layout::kRowMajor, true, true}};
constexpr Attribute kResample2dAttributes[] = {
    {"up", "boolean", "false", "to twice the size; set either up or down"},
    {"down", "boolean", "false", "to half the size"},
};

Result<Resample2dDesc> resample2d_desc(const Attributes& attributes, const Shape& x,
                                       const Shape& filter) {
    SPLAT_TRY(expect_images("resample2d", "x", x));
    if (attributes.boolean("up") == attributes.boolean("down"))
        return invalid("resample2d: up and down are both %s, expected one of them",
                       attributes.boolean("up") ? "true" : "false");
    if (filter.rank() > 1)
        return error(Code::kShape, "resample2d: tensor 'filter' has shape %s, expected [taps]",
                     filter.text().c_str());
    const std::uint32_t taps = filter.rank() == 1 ? filter[0] : 0;
    return Resample2dDesc{x[0], x[1], x[2], x[3], attributes.boolean("up"), taps};
}

Result<OpPlan> resample2d_plan(const vk::Recorder&, const Attributes& attributes,
                               std::span<const Shape> inputs) {
    const Shape& x = inputs[0];
    SPLAT_ASSIGN(const Resample2dDesc desc, resample2d_desc(attributes, x, inputs[1]));
    SPLAT_TRY(resample2d_check(desc));
    return OpPlan{.outputs = {desc.up ? Shape{x[0], x[1], 2 * x[2], 2 * x[3]}
                                      : Shape{x[0], x[1], x[2] / 2, x[3] / 2}}};
}

Status resample2d_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                              const OpViews& v) {
    SPLAT_ASSIGN(const Resample2dDesc desc,
                 resample2d_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    const vk::BufferView& filter = present(v.inputs[1]) ? v.inputs[1] : v.inputs[0];
    return record(recorder, "resample2d_forward", desc, desc.up, desc.height, desc.width,
                  {vk::read(v.inputs[0]), vk::read(filter), vk::write(v.outputs[0])});
}

Status resample2d_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                               const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const Resample2dDesc desc,
                 resample2d_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    const vk::BufferView& filter = present(v.inputs[1]) ? v.inputs[1] : v.grad_outputs[0];
    const auto other = [&](std::uint32_t size) { return desc.up ? 2 * size : size / 2; };
    return record(recorder, "resample2d_backward", desc, !desc.up, other(desc.height),
                  other(desc.width),
                  {vk::read(v.grad_outputs[0]), vk::read(filter), vk::write(v.grad_inputs[0])});
}

}  // namespace

const OpRow kResample2dRow = {
    .name = "resample2d",
    .equation = "y = x at twice or half the size, through the filter outer(f, f) / sum(f)^2",
    .inputs = kResample2dInputs,
    .outputs = kOutputY,
    .attributes = kResample2dAttributes,
    .plan = resample2d_plan,
    .forward = resample2d_row_forward,
    .backward = resample2d_row_backward,
    .backward_reads = no_backward_reads};

}  // namespace splat::ops
