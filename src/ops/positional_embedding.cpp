#include "ops/positional_embedding.h"

#include <cmath>

#include "core/checked_math.h"
#include "core/shape.h"
#include "params/positional_embedding_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

constexpr std::uint32_t kMaxDimension = 64;

Status record(vk::Recorder& recorder, const char* name, const PositionalEmbeddingDesc& desc,
              std::uint32_t channels, std::vector<vk::Access> accesses) {
    SPLAT_TRY(positional_embedding_check(desc));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups =
        vk::groups_for(recorder.device(), ceil_div(channels, 4) * desc.rows, size);
    const double values = static_cast<double>(desc.rows) * desc.features * desc.dimension;
    return recorder.dispatch({
        .op = name,
        .shader = name,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push =
            params::PositionalEmbeddingParams{
                desc.rows, desc.features, desc.dimension, desc.swap_halves ? 1U : 0U,
                static_cast<float>(std::pow(10000.0, -2.0 / desc.dimension)), groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 40 * values, .bytes = 8 * values},
    });
}

}  // namespace

Status positional_embedding_check(const PositionalEmbeddingDesc& desc) {
    if (desc.dimension < 2 || desc.dimension % 2 != 0 || desc.dimension > kMaxDimension)
        return error(Code::kInvalidArgument,
                     "positional_embedding: dimension is %u, expected an even number up to %u",
                     desc.dimension, kMaxDimension);
    const auto elements = checked_mul(desc.rows, (desc.features + 1ULL) * desc.dimension);
    if (!elements || *elements > kMaxElements)
        return error(Code::kUnsupported,
                     "positional_embedding: %u rows of %u features have 2^31 values or more",
                     desc.rows, desc.features);
    return {};
}

Status positional_embedding_forward(vk::Recorder& recorder, const PositionalEmbeddingDesc& desc,
                                    const vk::BufferView& x, const vk::BufferView& y) {
    return record(recorder, "positional_embedding_forward", desc, desc.features * desc.dimension,
                  {vk::read(x), vk::write(y)});
}

Status positional_embedding_backward(vk::Recorder& recorder, const PositionalEmbeddingDesc& desc,
                                     const vk::BufferView& x, const vk::BufferView& grad_y,
                                     const vk::BufferView& grad_x) {
    return record(recorder, "positional_embedding_backward", desc, desc.features,
                  {vk::read(x), vk::read(grad_y), vk::write(grad_x)});
}

}  // namespace splat::ops
