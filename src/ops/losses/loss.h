#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

/// Shared by the losses: sums over chunks of an image, and the mean of a term of each element.
namespace splat::ops {

/// Quads per workgroup of a forward pass, so few that each lane sums only a few terms.
inline constexpr std::uint32_t kLossChunk = 1024;

/// Number of partial sums of a loss over this many quads, and their bytes.
std::uint32_t loss_chunks(const QuadDims& dims);
std::uint64_t loss_partial_bytes(const QuadDims& dims);

/// loss = the sum of the partial sums over the number of elements.
///
/// partial      [loss_chunks]
/// loss         [1]
/// Errors       the recorder's
/// Precision    a few roundings: a tree of sums
/// Determinism  bit-exact for any thread count
Status loss_sum(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& partial,
                const vk::BufferView& loss);

/// 1 / elements.
float loss_scale(const QuadDims& dims);

/// Rows of losses: b is constant.
inline constexpr Port kLossInputs[] = {{"a"}, {"b", Layout::kQuads, false, true}};
inline constexpr Port kLossOutputs[] = {{"loss", Layout::kRowMajor}};
Result<OpPlan> loss_plan(const char* op, std::span<const Shape> inputs);

/// Both passes of a loss that is the mean of a term of a - b, by the kernel of that name.
Status pixel_loss_forward(vk::Recorder& recorder, const char* kernel, const OpViews& v);
Status pixel_loss_backward(vk::Recorder& recorder, const char* kernel, const OpViews& v);

}  // namespace splat::ops
