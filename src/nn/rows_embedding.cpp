#include <limits>

#include "nn/op_rows.h"
#include "ops/dropout.h"
#include "ops/fourier_embedding.h"
#include "ops/positional_embedding.h"

namespace splat::nn {
namespace {

constexpr Port kDropoutInputs[] = {{"x"}, {"counter", Layout::kRowMajor, false, true}};
constexpr Attribute kDropoutAttributes[] = {
    {"p", "number", "0.1", "probability of dropping an element; 0 <= p < 1"},
    {"stream", "integer", "0", "sets the calls of one step apart"},
};

Result<ops::DropoutDesc> dropout_desc(const Attributes& attributes, const Shape& x) {
    ops::DropoutDesc desc;
    SPLAT_ASSIGN(desc.x, ops::quad_dims(x));
    desc.p = attributes.number("p");
    const auto stream = attributes.integer("stream");
    if (stream < 0 || stream > std::numeric_limits<std::uint32_t>::max())
        return error(Code::kInvalidArgument, "dropout: stream is %lld, expected 0 to 2^32 - 1",
                     static_cast<long long>(stream));
    desc.stream = static_cast<std::uint32_t>(stream);
    return desc;
}

Result<OpPlan> dropout_plan(const vk::Recorder&, const Attributes& attributes,
                            std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::DropoutDesc desc, dropout_desc(attributes, inputs[0]));
    SPLAT_TRY(ops::dropout_check(desc));
    SPLAT_TRY(expect_shape("dropout", "counter", inputs[1], {4}));
    OpPlan plan;
    plan.outputs = {inputs[0]};
    return plan;
}

Status dropout_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::DropoutDesc desc, dropout_desc(attributes, v.inputs[0].shape));
    return ops::dropout_forward(recorder, desc, v.inputs[0], v.inputs[1], v.outputs[0]);
}

Status dropout_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::DropoutDesc desc, dropout_desc(attributes, v.inputs[0].shape));
    return ops::dropout_backward(recorder, desc, v.inputs[1], v.grad_outputs[0], v.grad_inputs[0]);
}

constexpr Port kEmbeddingInputs[] = {{"x"}};
constexpr Attribute kEmbeddingAttributes[] = {
    {"dimension", "integer", "10", "values per feature; half of them cosines; even, up to 64"},
    {"swap_halves", "boolean", "false", "the halves of the result change places"},
};

Result<ops::PositionalEmbeddingDesc> embedding_desc(const Attributes& attributes, const Shape& x) {
    if (x.rank() != 2)
        return error(Code::kShape,
                     "positional_embedding: tensor 'x' has shape %s, expected [rows, features]",
                     x.text().c_str());
    const auto dimension = attributes.integer("dimension");
    if (dimension < 2 || dimension > 64)
        return error(Code::kInvalidArgument,
                     "positional_embedding: dimension is %lld, expected an even number up to 64",
                     static_cast<long long>(dimension));
    return ops::PositionalEmbeddingDesc{x[0], x[1], static_cast<std::uint32_t>(dimension),
                                        attributes.boolean("swap_halves")};
}

Result<OpPlan> embedding_plan(const vk::Recorder&, const Attributes& attributes,
                              std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::PositionalEmbeddingDesc desc, embedding_desc(attributes, inputs[0]));
    SPLAT_TRY(ops::positional_embedding_check(desc));
    OpPlan plan;
    plan.outputs = {{desc.rows, desc.features * desc.dimension}};
    return plan;
}

Status embedding_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::PositionalEmbeddingDesc desc,
                 embedding_desc(attributes, v.inputs[0].shape));
    return ops::positional_embedding_forward(recorder, desc, v.inputs[0], v.outputs[0]);
}

Status embedding_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::PositionalEmbeddingDesc desc,
                 embedding_desc(attributes, v.inputs[0].shape));
    return ops::positional_embedding_backward(recorder, desc, v.inputs[0], v.grad_outputs[0],
                                              v.grad_inputs[0]);
}

constexpr Port kFourierInputs[] = {{"x"}, {"frequencies", Layout::kRowMajor, false, true}};

Result<ops::FourierEmbeddingDesc> fourier_desc(const Shape& x, const Shape& frequencies) {
    if (x.rank() != 2)
        return error(Code::kShape,
                     "fourier_embedding: tensor 'x' has shape %s, expected [rows, features]",
                     x.text().c_str());
    if (frequencies.rank() != 1)
        return error(Code::kShape,
                     "fourier_embedding: tensor 'frequencies' has shape %s, expected one dimension",
                     frequencies.text().c_str());
    return ops::FourierEmbeddingDesc{x[0], x[1], frequencies[0]};
}

Result<OpPlan> fourier_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::FourierEmbeddingDesc desc, fourier_desc(inputs[0], inputs[1]));
    SPLAT_TRY(ops::fourier_embedding_check(desc));
    OpPlan plan;
    plan.outputs = {{desc.rows, 2 * desc.features * desc.waves}};
    return plan;
}

Status fourier_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::FourierEmbeddingDesc desc,
                 fourier_desc(v.inputs[0].shape, v.inputs[1].shape));
    return ops::fourier_embedding_forward(recorder, desc, v.inputs[0], v.inputs[1], v.outputs[0]);
}

Status fourier_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::FourierEmbeddingDesc desc,
                 fourier_desc(v.inputs[0].shape, v.inputs[1].shape));
    return ops::fourier_embedding_backward(recorder, desc, v.inputs[0], v.inputs[1],
                                           v.grad_outputs[0], v.grad_inputs[0]);
}

}  // namespace

const OpRow kDropoutRow = {
    .name = "dropout",
    .equation = "y = x / (1 - p) where Philox(counter, stream, place) keeps it, else 0",
    .inputs = kDropoutInputs,
    .outputs = kOutputY,
    .saved = {},
    .attributes = kDropoutAttributes,
    .plan = dropout_plan,
    .prepare = nullptr,
    .forward = dropout_forward,
    .backward = dropout_backward,
    .backward_reads = no_backward_reads};

const OpRow kFourierEmbeddingRow = {
    .name = "fourier_embedding",
    .equation = "each feature s becomes cos(2 pi s f), then sin(2 pi s f), of all frequencies f",
    .inputs = kFourierInputs,
    .outputs = kOutputY,
    .saved = {},
    .attributes = {},
    .plan = fourier_plan,
    .prepare = nullptr,
    .forward = fourier_forward,
    .backward = fourier_backward};

const OpRow kPositionalEmbeddingRow = {
    .name = "positional_embedding",
    .equation = "each feature s becomes cos(s f_j), then sin(s f_j), f_j = 10000^(-2j/dimension)",
    .inputs = kEmbeddingInputs,
    .outputs = kOutputY,
    .saved = {},
    .attributes = kEmbeddingAttributes,
    .plan = embedding_plan,
    .prepare = nullptr,
    .forward = embedding_forward,
    .backward = embedding_backward};

}  // namespace splat::nn
