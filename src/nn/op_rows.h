#pragma once

#include "nn/op_table.h"

/// The rows of the operator table, one file rows_<group>.cpp per group, and what they share.
namespace splat::nn {

extern const OpRow kAddRow;
extern const OpRow kAttentionRow;
extern const OpRow kConcatRow;
extern const OpRow kConv2dRow;
extern const OpRow kDropoutRow;
extern const OpRow kFeatureDistanceRow;
extern const OpRow kFilmRow;
extern const OpRow kFourierEmbeddingRow;
extern const OpRow kGaussianHeadRow;
extern const OpRow kGroupNormRow;
extern const OpRow kL1Row;
extern const OpRow kL2Row;
extern const OpRow kLinearRow;
extern const OpRow kMaxPool2dRow;
extern const OpRow kPositionalEmbeddingRow;
extern const OpRow kReluRow;
extern const OpRow kResample2dRow;
extern const OpRow kSiluRow;
extern const OpRow kSplit3Row;
extern const OpRow kSsimRow;

inline constexpr Port kInputX[] = {{"x"}};
inline constexpr Port kOutputY[] = {{"y"}};

/// Whether an optional tensor is there, or a gradient wanted.
inline bool present(const vk::BufferView& view) {
    return view.block != nullptr;
}

/// OpRow::backward_reads of the product of the first two inputs: each for the gradient of the other.
bool product_backward_reads(std::size_t i, const std::vector<bool>& wanted);
/// Of a fixed linear map: no activation, the gradient is that of the output, mapped back.
bool no_backward_reads(std::size_t i, const std::vector<bool>& wanted);

Status expect_shape(const char* op, const char* tensor, const Shape& got, const Shape& expected);

}  // namespace splat::nn
