#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "io/tensor_file.h"
#include "io/torch/pickle.h"

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
    kScalar,
    kDefaultDict,
    kObject,  ///< made without arguments and given a state; neither has a meaning here
    kType     ///< named, never called
};

/// A name that a pickle may use.
struct PickleGlobal {
    std::string_view name;
    PickleRole role;
    NumberType type = NumberType::kF32;
};

/// The allow-list.
std::span<const PickleGlobal> pickle_globals();

/// What _codecs.encode(text, 'latin1') returns: the bytes that protocol 2 writes as text in UTF-8; nothing for a
/// character outside Latin-1.
std::optional<std::string> latin1(std::string_view text);

/// A number of NumPy: its type, such as "f8", and its bytes. Nothing for other types and sizes.
std::optional<PickleNode> numpy_scalar(std::string_view type, Bytes data);

}  // namespace splat::io
