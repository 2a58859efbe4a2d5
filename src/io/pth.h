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

/// Weights as torch.save() writes them since version 1.6: a zip of a pickle and one file for each
/// storage. They are the dict 'model_state_dict' or 'state_dict' of the pickle, or the pickle itself.
/// Tensors of any strides become row-major (convolutions in channels_last order). The device tag of a
/// storage is ignored. No code of the pickle is run, see pickle.h.
///
/// Errors       kFormat if the file is damaged, is not a state dict, or asks for more than the
///              limits allow; kUnsupported for the format before 1.6, big-endian files, and pickles
///              of anything other than weights
Result<PthFile> read_pth(const Source& source, const ReadLimits& limits = {});

/// Adam's state of one parameter.
struct AdamMoments {
    std::int64_t parameter = 0;  ///< its index in the optimiser's parameter list
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
Result<AdamState> read_pth_adam(const Source& source, const ReadLimits& limits = {});

/// Whether an archive with these files was written by torch.save().
bool is_pth_entry(const std::string& name);

/// The first bytes of a file from before PyTorch 1.6.
bool is_legacy_pth(Bytes head);

}  // namespace splat::io
