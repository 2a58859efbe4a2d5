#include "ops/positional_embedding.h"

#include <cmath>

#include "core/checked_math.h"
#include "core/shape.h"
#include "params/positional_embedding_params.h"

namespace splat::ops {
namespace {

constexpr std::uint32_t kMaxDimension = 64;

Status record(vk::Recorder& recorder, const char* name, const PositionalEmbeddingDesc& desc,
              std::uint32_t channels, std::vector<vk::Access> accesses) {
    SPLAT_TRY(positional_embedding_check(desc));
    const double values = static_cast<double>(desc.rows) * desc.features * desc.dimension;
    return record_each(recorder,
                       {.kernel = name,
                        .items = ceil_div(channels, 4) * desc.rows,
                        .accesses = std::move(accesses),
                        .work = {.flops = 40 * values, .bytes = 8 * values}},
                       [&](std::uint32_t groups_x) {
                           return params::PositionalEmbeddingParams{
                               desc.rows,
                               desc.features,
                               desc.dimension,
                               desc.swap_halves ? 1U : 0U,
                               static_cast<float>(std::pow(10000.0, -2.0 / desc.dimension)),
                               groups_x};
                       });
}

}  // namespace

Status positional_embedding_check(const PositionalEmbeddingDesc& desc) {
    if (desc.dimension < 2 || desc.dimension % 2 != 0 || desc.dimension > kMaxDimension)
        return invalid("positional_embedding: dimension is %u, expected an even number up to %u",
                       desc.dimension, kMaxDimension);
    const auto elements = checked_mul(desc.rows, (desc.features + 1ULL) * desc.dimension);
    if (!elements || *elements > kMaxElements)
        return unsupported("positional_embedding: %u rows of %u features have 2^31 values or more",
                           desc.rows, desc.features);
    return {};
}

namespace {

constexpr Attribute kPositionalEmbeddingAttributes[] = {
    {"dimension", "integer", "10", "values per feature; half of them cosines; even, up to 64"},
    {"swap_halves", "boolean", "false", "exchange the halves of the result"},
};

Result<PositionalEmbeddingDesc> positional_desc(const Attributes& attributes, const Shape& x) {
    if (x.rank() != 2)
        return error(Code::kShape,
                     "positional_embedding: tensor 'x' has shape %s, expected [rows, features]",
                     x.text().c_str());
    const auto dimension = attributes.integer("dimension");
    if (dimension < 2 || dimension > kMaxDimension)
        return invalid("positional_embedding: dimension is %lld, expected an even number up to %u",
                       lld(dimension), kMaxDimension);
    return PositionalEmbeddingDesc{x[0], x[1], static_cast<std::uint32_t>(dimension),
                                   attributes.boolean("swap_halves")};
}

Result<OpPlan> positional_embedding_plan(const vk::Recorder&, const Attributes& attributes,
                                         std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const PositionalEmbeddingDesc desc, positional_desc(attributes, inputs[0]));
    SPLAT_TRY(positional_embedding_check(desc));
    return OpPlan{.outputs = {Shape{desc.rows, desc.features * desc.dimension}}};
}

Status positional_embedding_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                                        const OpViews& v) {
    SPLAT_ASSIGN(const PositionalEmbeddingDesc desc,
                 positional_desc(attributes, v.inputs[0].shape));
    return record(recorder, "positional_embedding_forward", desc, desc.features * desc.dimension,
                  {vk::read(v.inputs[0]), vk::write(v.outputs[0])});
}

Status positional_embedding_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                                         const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const PositionalEmbeddingDesc desc,
                 positional_desc(attributes, v.inputs[0].shape));
    return record(
        recorder, "positional_embedding_backward", desc, desc.features,
        {vk::read(v.inputs[0]), vk::read(v.grad_outputs[0]), vk::write(v.grad_inputs[0])});
}

}  // namespace

const OpRow kPositionalEmbeddingRow = {
    .name = "positional_embedding",
    .equation = "each feature s becomes cos(s f_j), then sin(s f_j), f_j = 10000^(-2j/dimension)",
    .inputs = kInputX,
    .outputs = kOutputY,
    .attributes = kPositionalEmbeddingAttributes,
    .plan = positional_embedding_plan,
    .forward = positional_embedding_row_forward,
    .backward = positional_embedding_row_backward};

}  // namespace splat::ops
