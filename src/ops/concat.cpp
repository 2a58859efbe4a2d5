#include "ops/concat.h"

#include "core/checked_math.h"
#include "params/concat_params.h"

namespace splat::ops {
namespace {

using vk::BufferView;

std::uint64_t bytes_of(const ConcatDesc& desc, std::uint32_t channels) {
    return std::uint64_t{(channels + 3) / 4} * desc.columns * 16;
}

Status check(const ConcatDesc& desc) {
    const auto elements = checked_mul(desc.columns, round_up(std::uint64_t{desc.a} + desc.b, 4));
    if (!elements || *elements > kMaxElements)
        return unsupported("concat: %u and %u channels of %u pixels have 2^31 elements or more",
                           desc.a, desc.b, desc.columns);
    return {};
}

Status record(vk::Recorder& recorder, const char* kernel, const ConcatDesc& desc,
              std::uint32_t offset, std::uint32_t count, std::vector<vk::Access> accesses) {
    const std::uint64_t bytes = bytes_of(desc, count);
    return record_each(recorder,
                       {.kernel = kernel,
                        .items = bytes / 16,
                        .accesses = std::move(accesses),
                        .work = {.flops = 0, .bytes = 2 * static_cast<double>(bytes)}},
                       [&](std::uint32_t groups_x) {
                           return params::ConcatParams{desc.columns, desc.a, desc.b,
                                                       offset,       count,  groups_x};
                       });
}

}  // namespace

Status concat_forward(vk::Recorder& recorder, const ConcatDesc& desc, const BufferView& a,
                      const BufferView& b, const BufferView& y) {
    SPLAT_TRY(check(desc));
    if (desc.a % 4 != 0)
        return record(recorder, "concat_forward", desc, 0, desc.a + desc.b,
                      {vk::read(a), vk::read(b), vk::write(y)});
    const std::uint64_t bytes_a = bytes_of(desc, desc.a);
    const std::uint64_t bytes_b = bytes_of(desc, desc.b);
    SPLAT_TRY(recorder.copy(a.part(0, bytes_a), y.part(0, bytes_a)));
    return recorder.copy(b.part(0, bytes_b), y.part(bytes_a, bytes_b));
}

Status concat_backward(vk::Recorder& recorder, const ConcatDesc& desc, const BufferView& grad_y,
                       const BufferView& grad_a, const BufferView& grad_b) {
    SPLAT_TRY(check(desc));
    const auto take = [&](std::uint32_t offset, std::uint32_t count,
                          const BufferView& to) -> Status {
        if (to.block == nullptr) return {};
        if (desc.a % 4 == 0) {
            const std::uint64_t bytes = bytes_of(desc, count);
            return recorder.copy(grad_y.part(bytes_of(desc, offset), bytes), to.part(0, bytes));
        }
        return record(recorder, "concat_backward", desc, offset, count,
                      {vk::read(grad_y), vk::write(to)});
    };
    SPLAT_TRY(take(0, desc.a, grad_a));
    return take(desc.a, desc.b, grad_b);
}

namespace {

constexpr Port kConcatInputs[] = {{"a"}, {"b"}};

Result<ConcatDesc> concat_desc(const Shape& a, const Shape& b) {
    SPLAT_ASSIGN(const QuadDims of_a, quad_dims(a));
    bool alike = a.rank() == b.rank();
    for (std::uint32_t axis = 0; alike && axis < a.rank(); ++axis)
        alike = axis == 1 || a[axis] == b[axis];
    if (!alike)
        return error(Code::kShape,
                     "concat: tensor 'b' has shape %s, expected that of 'a', %s, except for the "
                     "channels",
                     b.text().c_str(), a.text().c_str());
    return ConcatDesc{of_a.n * of_a.p, a[1], b[1]};
}

Result<OpPlan> concat_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    SPLAT_TRY(concat_desc(inputs[0], inputs[1]).status());
    std::vector<std::int64_t> dims;
    for (std::uint32_t axis = 0; axis < inputs[0].rank(); ++axis)
        dims.push_back(std::int64_t{inputs[0][axis]} + (axis == 1 ? inputs[1][1] : 0));
    SPLAT_ASSIGN(const Shape shape, Shape::create(dims, "concat"));
    return OpPlan{.outputs = {shape}};
}

Status concat_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ConcatDesc desc, concat_desc(v.inputs[0].shape, v.inputs[1].shape));
    return concat_forward(recorder, desc, v.inputs[0], v.inputs[1], v.outputs[0]);
}

Status concat_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ConcatDesc desc, concat_desc(v.inputs[0].shape, v.inputs[1].shape));
    return concat_backward(recorder, desc, v.grad_outputs[0], v.grad_inputs[0], v.grad_inputs[1]);
}

}  // namespace

const OpRow kConcatRow = {.name = "concat",
                          .equation = "y = (a, b) along the channels",
                          .inputs = kConcatInputs,
                          .outputs = kOutputY,
                          .plan = concat_plan,
                          .forward = concat_row_forward,
                          .backward = concat_row_backward,
                          .backward_reads = no_backward_reads};

}  // namespace splat::ops
