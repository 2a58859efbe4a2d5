#pragma once

#include <utility>

#include "io/file.h"
#include "io/tensor_file.h"

namespace splat::io {

/// Texts that a file carries besides its tensors, in their order.
using Metadata = std::vector<std::pair<std::string, std::string>>;

struct SafetensorsFile {
    NamedTensors tensors;  ///< in the order of their data
    Metadata metadata;
};

/// A .safetensors file: 8 bytes of header size, a header of JSON, the tensors without gaps.
///
/// Errors       kFormat if it is damaged: a header beyond kMaxJsonBytes or the file, unknown
///              or missing keys, names given twice, offsets that overlap, leave a gap or do not fit
///              the shape; kUnsupported for types that NumberType lacks
/// Source       the format's README, https://github.com/huggingface/safetensors
Result<SafetensorsFile> read_safetensors(const Source& source,
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

}  // namespace splat::io
