#pragma once

#include <cstdint>
#include <string_view>

#include "io/tensor_file.h"

namespace splat::io {

/// How a call of a global is handled.
enum class PickleRole : std::uint8_t {
    kStorageType,
    kTensor,
    kParameter,
    kDict,
    kSize,
    kEncode,
    kDtype,
    kScalar
};

/// A name that a pickle may use.
struct PickleGlobal {
    std::string_view name;
    PickleRole role;
    NumberType type = NumberType::kF32;
};

/// The allow-list.
std::span<const PickleGlobal> pickle_globals();

}  // namespace splat::io
