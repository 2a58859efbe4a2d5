#pragma once

#include <optional>

#include "io/file.h"
#include "io/tensor_file.h"

namespace splat::io {

/// The numbers of a checkpoint besides its weights.
struct PthScalars {
    std::optional<std::int64_t> iteration;
    std::optional<double> loss;
    std::optional<double> best_psnr;
};

struct PthFile {
    NamedTensors tensors;
    PthScalars scalars;
    std::string section;  ///< where the tensors were: "model_state_dict", "state_dict", or ""
};

/// Weights of a file of torch.save(), see pth_archive.h: the dict 'model_state_dict' or 'state_dict' of its
/// pickle, or the pickle itself.
/// Tensors of any strides become row-major (convolutions in channels_last order). The device tag of a
/// storage is ignored. No code of the pickle is run, see pickle.h.
///
/// Errors       kFormat if the file is damaged, is not a state dict, or asks for more than the
///              limits allow; kUnsupported for big-endian files, and pickles of anything other
///              than weights
Result<PthFile> read_pth(const Source& source, const DecodeLimits& limits = decode_limits());

/// A checkpoint as the published code saves it: a dict of iteration, loss and best_PSNR, 0 where they are not
/// given, and model_state_dict; float32, or float16 with `half`. The pieces refer to the tensors.
///
/// Errors       kUnsupported from 4 GiB on; kInvalidArgument for finite values that float16 does not reach
Result<FilePieces> write_pth(const NamedTensors& tensors, const PthScalars& scalars,
                             bool half = false);
Result<FilePieces> write_pth(NamedTensors&& tensors, const PthScalars& scalars,
                             bool half = false) = delete;

/// Adam's state of one parameter.
struct AdamMoments {
    std::int64_t parameter = 0;  ///< index in the optimiser's parameter list
    double step = 0;
    NamedTensor exp_avg;
    NamedTensor exp_avg_sq;
};

struct AdamGroup {
    double lr = 0;
    double beta1 = 0;
    double beta2 = 0;
    double eps = 0;
    double weight_decay = 0;
    std::vector<std::int64_t> parameters;
};

struct AdamState {
    std::vector<AdamMoments> moments;
    std::vector<AdamGroup> groups;
};

/// The 'optimizer_state_dict' of such a file, of torch.optim.Adam. Errors: as read_pth(), and
/// kFormat if there is none.
Result<AdamState> read_pth_adam(const Source& source, const DecodeLimits& limits = decode_limits());

}  // namespace splat::io
