#include "ops/split3.h"

#include "params/split3_params.h"

namespace splat::ops {
namespace {

/// Copy between x and its stacked parts, which are ranges of it.
Status copy_stacked(vk::Recorder& recorder, std::uint64_t bytes, const vk::BufferView& x,
                    std::span<const vk::BufferView> parts, bool split) {
    for (std::size_t j = 0; j < parts.size(); ++j) {
        const vk::BufferView in_x = x.part(j * bytes, bytes);
        const vk::BufferView part = parts[j].part(0, bytes);
        SPLAT_TRY(split ? recorder.copy(in_x, part) : recorder.copy(part, in_x));
    }
    return {};
}

Status record_split3(vk::Recorder& recorder, const char* kernel, const QuadDims& dims,
                     std::vector<vk::Access> accesses) {
    return record_each(recorder,
                       {.kernel = kernel,
                        .items = dims.quads(),
                        .accesses = std::move(accesses),
                        .work = {.flops = 0, .bytes = 6 * static_cast<double>(dims.bytes())}},
                       [&](std::uint32_t groups_x) {
                           return params::Split3Params{dims.n * dims.p, dims.c, groups_x};
                       });
}

constexpr Port kSplit3Outputs[] = {{"a"}, {"b"}, {"c"}};
constexpr Attribute kSplit3Attributes[] = {
    {"stacked", "boolean", "false",
     "the parts follow each other, in whole quads; else they are interleaved"},
};

/// The dimensions of each part.
Result<QuadDims> part_dims(const Shape& x) {
    SPLAT_ASSIGN(QuadDims dims, quad_dims(x));
    if (dims.c % 3 != 0)
        return error(Code::kShape,
                     "split3: tensor 'x' has shape %s, expected a multiple of 3 channels",
                     x.text().c_str());
    dims.c /= 3;
    return dims;
}

Result<OpPlan> split3_plan(const vk::Recorder&, const Attributes& attributes,
                           std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const QuadDims part, part_dims(inputs[0]));
    if (attributes.boolean("stacked") && part.c % 4 != 0)
        return error(Code::kShape,
                     "split3: tensor 'x' has shape %s, expected a multiple of 12 channels, as its "
                     "parts are stacked",
                     inputs[0].text().c_str());
    std::vector<std::int64_t> dims;
    for (std::uint32_t axis = 0; axis < inputs[0].rank(); ++axis)
        dims.push_back(axis == 1 ? part.c : inputs[0][axis]);
    SPLAT_ASSIGN(const Shape shape, Shape::create(dims, "split3"));
    return OpPlan{.outputs = {shape, shape, shape}};
}

Status split3_row_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const QuadDims dims, part_dims(v.inputs[0].shape));
    if (attributes.boolean("stacked"))
        return copy_stacked(recorder, dims.bytes(), v.inputs[0], v.outputs, true);
    return record_split3(recorder, "split3_forward", dims,
                         {vk::read(v.inputs[0]), vk::write(v.outputs[0]), vk::write(v.outputs[1]),
                          vk::write(v.outputs[2])});
}

Status split3_row_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const QuadDims dims, part_dims(v.inputs[0].shape));
    if (attributes.boolean("stacked"))
        return copy_stacked(recorder, dims.bytes(), v.grad_inputs[0], v.grad_outputs, false);
    return record_split3(recorder, "split3_backward", dims,
                         {vk::read(v.grad_outputs[0]), vk::read(v.grad_outputs[1]),
                          vk::read(v.grad_outputs[2]), vk::write(v.grad_inputs[0])});
}

}  // namespace

const OpRow kSplit3Row = {.name = "split3",
                          .equation =
                              "a[n,c] = x[n,3c], b[n,c] = x[n,3c+1], c[n,c] = x[n,3c+2]; stacked: "
                              "x[n,c], x[n,C+c], x[n,2C+c]",
                          .inputs = kInputX,
                          .outputs = kSplit3Outputs,
                          .attributes = kSplit3Attributes,
                          .plan = split3_plan,
                          .forward = split3_row_forward,
                          .backward = split3_row_backward,
                          .backward_reads = no_backward_reads};

}  // namespace splat::ops
