#include "ops/images/resize2d.h"

#include <cmath>

#include "core/checked_math.h"
#include "params/images_params.h"

namespace splat::ops {
namespace {

/// Pixels of one side that kernels can place in those of the other, and turns of their loops: lavapipe ends loops after
/// 65535.
constexpr std::uint32_t kMaxSide = 1 << 20;
constexpr std::uint32_t kMaxFactor = 1024;

/// PyTorch copies a side whose length stays, at any scale. Its cubic filter without antialias does not.
double scale_of(const Resize2dDesc& desc, const Resize2dAxis& axis) {
    const bool copied = axis.from == axis.to && (desc.antialias || !desc.cubic);
    return axis.scale > 0 && !copied ? axis.scale : static_cast<double>(axis.to) / axis.from;
}

bool same(const Resize2dDesc& desc, const Resize2dAxis& axis) {
    return axis.from == axis.to && scale_of(desc, axis) == 1;
}

/// One axis, of tensors [outer, size, inner] of quads.
struct AxisPass {
    Resize2dAxis axis;
    std::uint32_t outer;
    std::uint32_t inner;

    [[nodiscard]] std::uint64_t bytes() const {
        return std::uint64_t{16} * outer * inner * axis.to;
    }
};

/// In the order of the forward pass: one, or two with a tensor between them, the smaller of both choices.
std::vector<AxisPass> passes_of(const Resize2dDesc& desc) {
    const std::uint32_t planes = (desc.c + 3) / 4 * desc.n;
    if (same(desc, desc.rows)) return {{desc.columns, planes * desc.rows.from, 1}};
    if (same(desc, desc.columns)) return {{desc.rows, planes, desc.columns.from}};
    const AxisPass rows{desc.rows, planes, desc.columns.from};
    const AxisPass columns{desc.columns, planes * desc.rows.from, 1};
    if (rows.bytes() <= columns.bytes()) return {rows, {desc.columns, planes * desc.rows.to, 1}};
    return {columns, {desc.rows, planes, desc.columns.to}};
}

Status record_pass(vk::Recorder& recorder, const Resize2dDesc& desc, const AxisPass& pass,
                   bool back, const vk::BufferView& x, const vk::BufferView& y) {
    const std::uint64_t lines = std::uint64_t{pass.outer} * pass.inner;
    const double scale = scale_of(desc, pass.axis);
    const double stretch = desc.antialias ? std::max(1.0, 1 / scale) : 1.0;
    const double taps = (desc.cubic ? 4 : 2) * stretch;
    const double from = 4.0 * static_cast<double>(lines * pass.axis.from);
    const double to = 4.0 * static_cast<double>(lines * pass.axis.to);
    double whole = 0;
    double high = 0;
    const double low = std::modf(std::ldexp(std::modf(0.5 / scale, &whole), 32), &high);
    return record_each(recorder,
                       {.kernel = back ? "resize2d_backward" : "resize2d_forward",
                        .items = lines * (back ? pass.axis.from : pass.axis.to),
                        .accesses = {vk::read(x), vk::write(y)},
                        .work = {.flops = 2 * taps * to, .bytes = 4 * (from + to)},
                        .constants = {{params::kResize2dCubicId, desc.cubic ? 1U : 0U},
                                      {params::kResize2dAntialiasId, desc.antialias ? 1U : 0U}}},
                       [&](std::uint32_t groups_x) {
                           params::Resize2dParams params{};
                           params.outer = pass.outer;
                           params.inner = pass.inner;
                           params.from = pass.axis.from;
                           params.to = pass.axis.to;
                           params.step_whole = static_cast<std::uint32_t>(whole);
                           params.step_high = static_cast<std::uint32_t>(high);
                           params.step_low = static_cast<std::uint32_t>(std::ldexp(low, 32));
                           params.rate = static_cast<float>(scale);
                           params.stretch = static_cast<float>(stretch);
                           params.groups_x = groups_x;
                           return params;
                       });
}

/// x to y, or, for gradients, y to x; `between` has the tensor between two passes.
Status record(vk::Recorder& recorder, const Resize2dDesc& desc, bool back, const vk::BufferView& x,
              const vk::BufferView& y, const vk::BufferView& between) {
    SPLAT_TRY(resize2d_check(desc));
    const std::vector<AxisPass> passes = passes_of(desc);
    if (passes.size() == 1) return record_pass(recorder, desc, passes[0], back, x, y);
    const vk::BufferView middle = between.part(0, passes[0].bytes());
    SPLAT_TRY(record_pass(recorder, desc, passes[back ? 1 : 0], back, x, middle));
    return record_pass(recorder, desc, passes[back ? 0 : 1], back, middle, y);
}

Status check_axis(const Resize2dAxis& axis, const char* what) {
    if (std::max(axis.from, axis.to) > kMaxSide || (axis.to - 1) / kMaxFactor >= axis.from ||
        (axis.from - 1) / kMaxFactor >= axis.to)
        return unsupported(
            "resize2d: from %u to %u %s, expected at most %u, by a factor of at most %u", axis.from,
            axis.to, what, kMaxSide, kMaxFactor);
    const double reached = axis.from * axis.scale;
    if (axis.scale != 0 && !(axis.scale > 0 && std::abs(reached - axis.to) <= 1))
        return invalid(
            "resize2d: a scale of %g takes %u %s to %g, expected those of y, %u, within one",
            axis.scale, axis.from, what, reached, axis.to);
    return {};
}

}  // namespace

Status resize2d_check(const Resize2dDesc& desc) {
    SPLAT_TRY(check_axis(desc.rows, "rows"));
    SPLAT_TRY(check_axis(desc.columns, "columns"));
    const std::uint64_t pixels = std::uint64_t{std::max(desc.rows.from, desc.rows.to)} *
                                 std::max(desc.columns.from, desc.columns.to);
    const auto plane = checked_mul(pixels, round_up(desc.c, 4));
    const auto all = plane ? checked_mul(*plane, desc.n) : plane;
    if (!all || *all > kMaxElements)
        return unsupported(
            "resize2d: %u images of %u channels, of the larger of %u x %u and %u x %u "
            "pixels, have 2^31 elements or more",
            desc.n, desc.c, desc.rows.from, desc.columns.from, desc.rows.to, desc.columns.to);
    return {};
}

namespace {

constexpr Attribute kResize2dAttributes[] = {
    {"width", "integer", "0", "columns of y"},
    {"height", "integer", "0", "rows of y"},
    {"filter", "integer", "0", "0: linear, 1: cubic"},
    {"antialias", "boolean", "false", "stretch the filter where y is smaller"},
    {"scale_x", "number", "0", "columns of y for each of x; 0: the quotient of the widths"},
    {"scale_y", "number", "0", "rows of y for each of x; 0: the quotient of the heights"},
};

Result<Resize2dDesc> resize2d_desc(const Attributes& attributes, const Shape& x) {
    SPLAT_TRY(expect_images("resize2d", "x", x));
    Resize2dDesc desc;
    desc.n = x[0];
    desc.c = x[1];
    const auto axis = [&](Resize2dAxis& to, std::uint32_t from, const char* size,
                          const char* scale) -> Status {
        const std::int64_t wanted = attributes.integer(size);
        if (wanted < 1 || wanted > kMaxSide)
            return invalid("resize2d: %s is %lld, expected 1 to %u", size, lld(wanted), kMaxSide);
        to = {from, static_cast<std::uint32_t>(wanted), attributes.number(scale)};
        return {};
    };
    SPLAT_TRY(axis(desc.rows, x[2], "height", "scale_y"));
    SPLAT_TRY(axis(desc.columns, x[3], "width", "scale_x"));
    const std::int64_t filter = attributes.integer("filter");
    if (filter != 0 && filter != 1)
        return invalid("resize2d: filter is %lld, expected 0 (linear) or 1 (cubic)", lld(filter));
    desc.cubic = filter == 1;
    desc.antialias = attributes.boolean("antialias");
    return desc;
}

Result<OpPlan> resize2d_plan(const vk::Recorder&, const Attributes& attributes,
                             std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const Resize2dDesc desc, resize2d_desc(attributes, inputs[0]));
    SPLAT_TRY(resize2d_check(desc));
    const std::vector<AxisPass> passes = passes_of(desc);
    const std::uint64_t between = passes.size() == 1 ? 0 : passes[0].bytes();
    return OpPlan{.outputs = {Shape{desc.n, desc.c, desc.rows.to, desc.columns.to}},
                  .forward_workspace = between,
                  .backward_workspace = between};
}

Status resize2d_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                            const OpViews& v) {
    SPLAT_ASSIGN(const Resize2dDesc desc, resize2d_desc(attributes, v.inputs[0].shape));
    return record(recorder, desc, false, v.inputs[0], v.outputs[0], v.workspace);
}

Status resize2d_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                             const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const Resize2dDesc desc, resize2d_desc(attributes, v.inputs[0].shape));
    return record(recorder, desc, true, v.grad_outputs[0], v.grad_inputs[0], v.workspace);
}

}  // namespace

const OpRow kResize2dRow = {.name = "resize2d",
                            .equation = "y = x at height x width, by linear or cubic interpolation",
                            .inputs = kInputX,
                            .outputs = kOutputY,
                            .attributes = kResize2dAttributes,
                            .plan = resize2d_plan,
                            .forward = resize2d_row_forward,
                            .backward = resize2d_row_backward,
                            .backward_reads = no_backward_reads};

}  // namespace splat::ops
