#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <span>
#include <string_view>
#include <vector>

#include "scene/activate.h"

namespace splat::io {

using Bytes = std::span<const std::byte>;
using Buffer = std::vector<std::byte>;

static_assert(std::endian::native == std::endian::little, "number() and put() swap for big endian");

inline Bytes as_bytes(std::string_view text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

inline std::string_view as_text(Bytes bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A number of the file; the caller has checked that sizeof(T) bytes are there.
template <class T>
T number(const std::byte* at, std::endian order = std::endian::little) {
    std::byte bytes[sizeof(T)];
    std::memcpy(bytes, at, sizeof bytes);
    if (order == std::endian::big) std::ranges::reverse(bytes);
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

/// Append a number.
template <class T>
void put(Buffer& to, T value, std::endian order = std::endian::little) {
    std::byte bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof value);
    if (order == std::endian::big) std::ranges::reverse(bytes);
    const std::size_t place = to.size();
    to.resize(place + sizeof bytes);  // gcc 12 takes an insert of constant length for an overflow
    std::memcpy(to.data() + place, bytes, sizeof bytes);
}

inline void put_bytes(Buffer& to, Bytes bytes) {
    to.insert(to.end(), bytes.begin(), bytes.end());
}

inline void put_text(Buffer& to, std::string_view text) {
    put_bytes(to, as_bytes(text));
}

/// The nearest byte; what is outside 0 to 255 is clamped. NaN gives 0.
inline std::uint8_t to_byte(double value) {
    if (!(value > 0)) return 0;
    return static_cast<std::uint8_t>(value >= 255 ? 255 : std::lround(value));
}

/// Bytes for opacity, and back. 0 and 255 stand for logits of -/+ kMaxOpacityLogit.
inline std::uint8_t opacity_byte(float logit) {
    return to_byte(255 * scene::opacity_of(static_cast<double>(logit)));
}

inline float opacity_logit(std::uint8_t byte) {
    return static_cast<float>(scene::logit_of(byte / 255.0));
}

/// True if all of `each` values of Gaussian i are finite.
inline bool all_finite(const std::vector<float>& values, std::size_t i, std::size_t each) {
    for (std::size_t k = i * each; k < (i + 1) * each; ++k)
        if (!std::isfinite(values[k])) return false;
    return true;
}

}  // namespace splat::io
