#pragma once

#include "gaussians/gaussian_set.h"
#include "vk/recorder.h"

namespace splat::ops {

/// Attributes of Gaussians, or their gradients, in one row-major float32 array each. A view
/// without a buffer is absent.
struct GaussianRows {
    vk::BufferView means;      ///< [N,3]
    vk::BufferView scales;     ///< [N,3]
    vk::BufferView rotations;  ///< [N,4]
    vk::BufferView opacities;  ///< [N]
    vk::BufferView colors;     ///< [N,(degree+1)^2,3], or [N,3] for direct colours
};

/// Copy the attributes that are present to their places in a set of desc.gaussians Gaussians. Errors:
/// the recorder's.
Status pack_rows(vk::Recorder& recorder, const gaussians::SetDesc& desc, const GaussianRows& from,
                 const gaussians::SetViews& to);

/// Copy a set, or its gradients, to the arrays that are present, or add it if `accumulate`. Errors: the
/// recorder's.
Status unpack_rows(vk::Recorder& recorder, const gaussians::SetDesc& desc,
                   const gaussians::SetViews& from, const GaussianRows& to, bool accumulate);

}  // namespace splat::ops
