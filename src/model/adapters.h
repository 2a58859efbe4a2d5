#pragma once

#include "io/tensor_file.h"
#include "io/weights_file.h"
#include "model/model.h"
#include "model/weights.h"

namespace splat::model {

/// A file of only low-rank adapters has, for each adapted layer, tensors with the names and shapes of
/// Hugging Face's PEFT:
///
///   base_model.model.<layer>.lora_A.weight  [rank, in, k, k]
///   base_model.model.<layer>.lora_B.weight  [out, rank, 1, 1]
///
/// for a linear layer without the taps, [rank, in] and [out, rank]; as safetensors also lora_alpha and
/// lora_rank in its metadata. The names of state dicts are read too, "<layer>.lora_A" [rank, in * k * k]
/// and "<layer>.lora_B" [out, rank]; the numbers are in the same order.

/// Errors: kInvalidState if the model has no adapters.
Result<io::WeightsFile> save_adapters(Model& model);

/// Fill the adapters of a model, all or none; other parameters are unchanged.
///
/// Errors  kInvalidState if it has none; kInvalidArgument for a tensor that is not an adapter, a missing
///         or non-finite one, or an alpha other than the configuration's; kShape
Status load_adapters(Model& model, const io::WeightsFile& file, LoadReport& report);

/// Accepts both kinds of names.
bool has_adapters(const io::NamedTensors& tensors);

/// Fold adapters into the weights they adapt: W + alpha / rank * (B A) in W's shape, and the other tensors
/// without the adapters; `sign` -1 takes them out again. If only one of the two files has the earlier
/// names of a network without offset, its names are mapped to those of the other.
///
/// Errors     kInvalidArgument for half a pair, a missing weight, or a result that is not finite; kShape for
///            shapes that do not multiply
/// Precision  one rounding of each weight, from float64
Result<io::NamedTensors> merge_adapters(const io::NamedTensors& tensors,
                                        const io::NamedTensors& adapters, double alpha, int sign);

}  // namespace splat::model
