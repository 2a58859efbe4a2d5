#pragma once

#include "nn/parameters.h"
#include "vision/moge_net.h"

namespace splat::vision {

/// Check that a file has the tensors that the layers need, in their shapes and finite, and those of `others`, and no
/// more. Errors: kFormat: the first that is missing and how many there are, a shape, a number that is not finite, the
/// first that no layer needs.
Status check_tensors(const io::NamedTensors& tensors, const std::map<std::string, Origin>& origins,
                     const std::map<std::string, std::vector<std::int64_t>>& others);

/// A parameter's values; the tensors have been checked.
std::vector<float> values_of(const Origin& origin, const io::NamedTensors& tensors);

}  // namespace splat::vision
