#pragma once

#include "io/tensor_file.h"

namespace splat::io {

/// What network the names of tensors look like, for messages about weights that were given to another one: "MoGe-2",
/// "a SongUNet, as of Splatter Image or F3D-Gaus"; without one that is known, the first tensor's name.
std::string network_text(const NamedTensors& tensors);

}  // namespace splat::io
