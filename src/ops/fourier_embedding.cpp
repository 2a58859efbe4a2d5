#include "ops/fourier_embedding.h"

#include "core/checked_math.h"
#include "core/shape.h"
#include "params/fourier_embedding_params.h"

namespace splat::ops {
namespace {

/// The gradient takes four turns for each in one invocation, see kMaxTurns in vk/launch.h.
constexpr std::uint32_t kMaxFrequencies = 16000;

Status record(vk::Recorder& recorder, const char* name, const FourierEmbeddingDesc& desc,
              std::uint32_t channels, std::vector<vk::Access> accesses) {
    SPLAT_TRY(fourier_embedding_check(desc));
    const double values = 2.0 * desc.rows * desc.features * desc.waves;
    return record_each(
        recorder,
        {.kernel = name,
         .items = ceil_div(channels, 4) * desc.rows,
         .accesses = std::move(accesses),
         .work = {.flops = 60 * values, .bytes = 4 * values}},
        [&](std::uint32_t groups_x) {
            return params::FourierEmbeddingParams{desc.rows, desc.features, desc.waves, groups_x};
        });
}

}  // namespace

Status fourier_embedding_check(const FourierEmbeddingDesc& desc) {
    const auto width = checked_mul(2ULL * desc.features, desc.waves);
    const auto elements = width ? checked_mul(desc.rows, *width) : width;
    if (!elements || *elements > kMaxElements)
        return unsupported(
            "fourier_embedding: %u rows of %u features with %u frequencies have 2^31 "
            "values or more",
            desc.rows, desc.features, desc.waves);
    if (desc.waves > kMaxFrequencies)
        return unsupported("fourier_embedding: %u frequencies, expected at most %u", desc.waves,
                           kMaxFrequencies);
    return {};
}

namespace {

constexpr Port kFourierEmbeddingInputs[] = {{"x"}, {"frequencies", Layout::kRowMajor, false, true}};

Result<FourierEmbeddingDesc> fourier_desc(const Shape& x, const Shape& frequencies) {
    if (x.rank() != 2)
        return error(Code::kShape,
                     "fourier_embedding: tensor 'x' has shape %s, expected [rows, features]",
                     x.text().c_str());
    if (frequencies.rank() != 1)
        return error(Code::kShape,
                     "fourier_embedding: tensor 'frequencies' has shape %s, expected one dimension",
                     frequencies.text().c_str());
    return FourierEmbeddingDesc{x[0], x[1], frequencies[0]};
}

Result<OpPlan> fourier_embedding_plan(const vk::Recorder&, const Attributes&,
                                      std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const FourierEmbeddingDesc desc, fourier_desc(inputs[0], inputs[1]));
    SPLAT_TRY(fourier_embedding_check(desc));
    return OpPlan{.outputs = {Shape{desc.rows, 2 * desc.features * desc.waves}}};
}

Status fourier_embedding_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const FourierEmbeddingDesc desc,
                 fourier_desc(v.inputs[0].shape, v.inputs[1].shape));
    return record(recorder, "fourier_embedding_forward", desc, 2 * desc.features * desc.waves,
                  {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::write(v.outputs[0])});
}

Status fourier_embedding_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const FourierEmbeddingDesc desc,
                 fourier_desc(v.inputs[0].shape, v.inputs[1].shape));
    return record(recorder, "fourier_embedding_backward", desc, desc.features,
                  {vk::read(v.inputs[0]), vk::read(v.inputs[1]), vk::read(v.grad_outputs[0]),
                   vk::write(v.grad_inputs[0])});
}

}  // namespace

const OpRow kFourierEmbeddingRow = {
    .name = "fourier_embedding",
    .equation = "each feature s becomes cos(2 pi s f), then sin(2 pi s f), of all frequencies f",
    .inputs = kFourierEmbeddingInputs,
    .outputs = kOutputY,
    .plan = fourier_embedding_plan,
    .forward = fourier_embedding_row_forward,
    .backward = fourier_embedding_row_backward};

}  // namespace splat::ops
