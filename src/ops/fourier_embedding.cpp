#include "ops/fourier_embedding.h"

#include "core/checked_math.h"
#include "core/shape.h"
#include "params/fourier_embedding_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* name, const FourierEmbeddingDesc& desc,
              std::uint32_t channels, std::vector<vk::Access> accesses) {
    SPLAT_TRY(fourier_embedding_check(desc));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups =
        vk::groups_for(recorder.device(), ceil_div(channels, 4) * desc.rows, size);
    const double values = 2.0 * desc.rows * desc.features * desc.waves;
    return recorder.dispatch({
        .op = name,
        .shader = name,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::FourierEmbeddingParams{desc.rows, desc.features, desc.waves, groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 60 * values, .bytes = 4 * values},
    });
}

}  // namespace

Status fourier_embedding_check(const FourierEmbeddingDesc& desc) {
    const auto width = checked_mul(2ULL * desc.features, desc.waves);
    const auto elements = width ? checked_mul(desc.rows, *width) : width;
    if (!elements || *elements > kMaxElements)
        return error(Code::kUnsupported,
                     "fourier_embedding: %u rows of %u features with %u frequencies have 2^31 "
                     "values or more",
                     desc.rows, desc.features, desc.waves);
    return {};
}

Status fourier_embedding_forward(vk::Recorder& recorder, const FourierEmbeddingDesc& desc,
                                 const vk::BufferView& x, const vk::BufferView& frequencies,
                                 const vk::BufferView& y) {
    return record(recorder, "fourier_embedding_forward", desc, 2 * desc.features * desc.waves,
                  {vk::read(x), vk::read(frequencies), vk::write(y)});
}

Status fourier_embedding_backward(vk::Recorder& recorder, const FourierEmbeddingDesc& desc,
                                  const vk::BufferView& x, const vk::BufferView& frequencies,
                                  const vk::BufferView& grad_y, const vk::BufferView& grad_x) {
    return record(recorder, "fourier_embedding_backward", desc, desc.features,
                  {vk::read(x), vk::read(frequencies), vk::read(grad_y), vk::write(grad_x)});
}

}  // namespace splat::ops
