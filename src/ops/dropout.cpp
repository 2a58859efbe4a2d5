#include "ops/dropout.h"

#include <limits>

#include "params/dropout_params.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* kernel, const DropoutDesc& desc,
              const vk::BufferView& from, const vk::BufferView& counter, const vk::BufferView& to) {
    SPLAT_TRY(dropout_check(desc));
    const double bytes = static_cast<double>(desc.x.bytes());
    return record_each(recorder,
                       {.kernel = kernel,
                        .items = desc.x.quads(),
                        .accesses = {vk::read(from), vk::read(counter), vk::write(to)},
                        .work = {.flops = 5 * bytes, .bytes = 2 * bytes},
                        .may_alias = true},
                       [&](std::uint32_t groups_x) {
                           return params::DropoutParams{static_cast<std::uint32_t>(desc.x.quads()),
                                                        desc.stream, dropout_threshold(desc.p),
                                                        static_cast<float>(1 / (1 - desc.p)),
                                                        groups_x};
                       });
}

}  // namespace

Status dropout_check(const DropoutDesc& desc) {
    if (!(desc.p >= 0 && desc.p < 1))
        return invalid("dropout: p is %g, expected 0 <= p < 1", desc.p);
    return {};
}

std::uint32_t dropout_threshold(double p) {
    return static_cast<std::uint32_t>(p * 0x1p32);
}

namespace {

constexpr Port kDropoutInputs[] = {{"x"}, {"counter", Layout::kRowMajor, false, true}};
constexpr Attribute kDropoutAttributes[] = {
    {"p", "number", "0.1", "probability of dropping an element; 0 <= p < 1"},
    {"stream", "integer", "0", "distinguishes the calls of one step"},
};

Result<DropoutDesc> dropout_desc(const Attributes& attributes, const Shape& x) {
    DropoutDesc desc;
    SPLAT_ASSIGN(desc.x, quad_dims(x));
    desc.p = attributes.number("p");
    const auto stream = attributes.integer("stream");
    if (stream < 0 || stream > std::numeric_limits<std::uint32_t>::max())
        return invalid("dropout: stream is %lld, expected 0 to 2^32 - 1", lld(stream));
    desc.stream = static_cast<std::uint32_t>(stream);
    return desc;
}

Result<OpPlan> dropout_plan(const vk::Recorder&, const Attributes& attributes,
                            std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const DropoutDesc desc, dropout_desc(attributes, inputs[0]));
    SPLAT_TRY(dropout_check(desc));
    SPLAT_TRY(expect_shape("dropout", "counter", inputs[1], {4}));
    return OpPlan{.outputs = {inputs[0]}};
}

Status dropout_row_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const DropoutDesc desc, dropout_desc(attributes, v.inputs[0].shape));
    return record(recorder, "dropout_forward", desc, v.inputs[0], v.inputs[1], v.outputs[0]);
}

Status dropout_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                            const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const DropoutDesc desc, dropout_desc(attributes, v.inputs[0].shape));
    return record(recorder, "dropout_backward", desc, v.grad_outputs[0], v.inputs[1],
                  v.grad_inputs[0]);
}

}  // namespace

const OpRow kDropoutRow = {
    .name = "dropout",
    .equation = "y = x / (1 - p) where Philox(counter, stream, place) keeps it, else 0",
    .inputs = kDropoutInputs,
    .outputs = kOutputY,
    .attributes = kDropoutAttributes,
    .plan = dropout_plan,
    .forward = dropout_row_forward,
    .backward = dropout_row_backward,
    .backward_reads = no_backward_reads};

}  // namespace splat::ops
