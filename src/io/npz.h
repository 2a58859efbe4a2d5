#pragma once

#include "io/file.h"
#include "io/tensor_file.h"

namespace splat::io {

struct NpzFile {
    NamedTensors tensors;
    std::vector<std::string> ignored;  ///< names of members that hold text
};

/// A .npz file, stored or deflated: an archive of .npy arrays, named after its members. Texts are
/// ignored.
///
/// Errors       kFormat if it is damaged or asks for more than the limits allow;
///              kUnsupported for complex numbers, column-major arrays and members that are not arrays
/// Source       NumPy's documentation, numpy.lib.format and numpy.savez
Result<NpzFile> read_npz(const Source& source, const DecodeLimits& limits = decode_limits());

/// Stored, float32, or float16 with `half`. The pieces refer to the tensors. Errors: kUnsupported
/// from 4 GiB on; kInvalidArgument for finite values that float16 does not reach.
Result<FilePieces> write_npz(const NamedTensors& tensors, bool half = false);
Result<FilePieces> write_npz(NamedTensors&& tensors, bool half = false) = delete;

}  // namespace splat::io
