#pragma once

#include "io/tensor_file.h"

namespace splat::io {

/// A .safetensors file: 8 bytes of header size, a header of JSON, the tensors without gaps; they
/// come in the order of their data.
///
/// Errors       kFormat if it is damaged: a header beyond kMaxJsonBytes or the file, unknown
///              or missing keys, names given twice, offsets that overlap, leave a gap or do not fit
///              the shape; kUnsupported for types that NumberType lacks
/// Source       the format's README, https://github.com/huggingface/safetensors
Result<WeightsFile> read_safetensors(const Source& source,
                                     const DecodeLimits& limits = decode_limits());

/// float32, or float16 with `half`; the data starts at a multiple of 8 bytes. The pieces refer to the
/// tensors. Errors: kInvalidArgument for a tensor named "__metadata__", for a name that is
/// not UTF-8, for a header beyond kMaxJsonBytes, and for finite values that float16 does not reach.
Result<FilePieces> write_safetensors(const NamedTensors& tensors, const Metadata& metadata = {},
                                     bool half = false);
Result<FilePieces> write_safetensors(NamedTensors&& tensors, const Metadata& metadata = {},
                                     bool half = false) = delete;

/// The first bytes of such a file.
bool is_safetensors(Bytes head);

/// A .npz file, stored or deflated: an archive of .npy arrays, named after its members. Texts are
/// ignored, with a warning.
///
/// Errors       kFormat if it is damaged or asks for more than the limits allow;
///              kUnsupported for complex numbers, column-major arrays and members that are not arrays
/// Source       NumPy's documentation, numpy.lib.format and numpy.savez
Result<WeightsFile> read_npz(const Source& source, const DecodeLimits& limits = decode_limits());

/// Stored, float32, or float16 with `half`. The pieces refer to the tensors. Errors: kUnsupported
/// from 4 GiB on; kInvalidArgument for finite values that float16 does not reach.
Result<FilePieces> write_npz(const NamedTensors& tensors, bool half = false);
Result<FilePieces> write_npz(NamedTensors&& tensors, bool half = false) = delete;

/// Weights of a file of torch.save(), see pth_archive.h: the dict 'model_state_dict', 'state_dict' or 'model' of its
/// pickle, or the pickle itself. A dict 'model_config' beside it becomes metadata of that name, as JSON.
/// Tensors of any strides become row-major (convolutions in channels_last order). The device tag of a
/// storage is ignored. No code of the pickle is run, see pickle.h.
///
/// Errors       kFormat if the file is damaged, is not a state dict, or asks for more than the
///              limits allow; kUnsupported for big-endian files, and pickles of anything other
///              than weights
Result<WeightsFile> read_pth(const Source& source, const DecodeLimits& limits = decode_limits());

/// A checkpoint as the published code saves it: a dict of iteration, loss and best_PSNR of the metadata, 0 where they
/// are not given, and model_state_dict; float32, or float16 with `half`. The pieces refer to the tensors.
///
/// Errors       kUnsupported from 4 GiB on; kInvalidArgument for finite values that float16 does not reach, and for
///              such metadata that is not a number
Result<FilePieces> write_pth(const NamedTensors& tensors, const Metadata& metadata = {},
                             bool half = false);
Result<FilePieces> write_pth(NamedTensors&& tensors, const Metadata& metadata = {},
                             bool half = false) = delete;

}  // namespace splat::io
