#pragma once

#include <string>

#include "io/tensor_file.h"

namespace splat::io {

const char* weights_format_name(WeightsFormat format);  ///< "safetensors", "pth", "npz"

/// True for a file of such a format, or of such an extension (.safetensors, .pt, .pth), so that a damaged one is
/// read as what it should be. False without a file.
bool is_weights_file(const std::string& path);

/// Weights of a .safetensors, .pth or .npz file; detected by its contents, not its name.
/// Values that are not finite are kept, see check_finite().
///
/// Errors       as read_file(); kFormat if the file is damaged or of another format;
///              kUnsupported for what a format may hold and this library does not read; each with
///              the path and the format's own sentence
/// in_place     values may stay in the mapped file, see MappedFile
Result<WeightsFile> load_weights(const std::string& path,
                                 const DecodeLimits& limits = decode_limits(),
                                 bool in_place = false);

/// Read from bytes; `name` stands for the path in messages.
Result<WeightsFile> read_weights(const Source& source, const std::string& name,
                                 const DecodeLimits& limits = decode_limits());

/// The bytes of a file: .safetensors (with metadata), .pth (with the metadata named above) or .npz (tensors
/// only), float32, or float16 with `half`. The pieces refer to the tensors. Errors: kInvalidArgument for such
/// metadata that is not a number; as write_safetensors(), write_pth() and write_npz().
Result<FilePieces> write_weights(const WeightsFile& weights, WeightsFormat format,
                                 bool half = false);
Result<FilePieces> write_weights(WeightsFile&& weights, WeightsFormat format,
                                 bool half = false) = delete;

/// Replace or create the file, as a whole or not at all. Its extension chooses the format. Errors:
/// kUnsupported for another extension; as write_weights() and write_file().
Status save_weights(const WeightsFile& weights, const std::string& path, bool half = false);

}  // namespace splat::io
