#pragma once

#include "io/tensor_file.h"

namespace splat::test {

/// Tensors of a MoGe-2 of a few channels with the structure of the published ones: blocks without normalisations, two
/// taps, the last level reached bilinearly. Numbers that look random.
io::NamedTensors small_moge(bool normals = true);

/// The same without a tensor, or with one changed.
io::NamedTensors without(const io::NamedTensors& tensors, const std::string& name);
io::NamedTensors with(const io::NamedTensors& tensors, io::NamedTensor tensor);

}  // namespace splat::test
