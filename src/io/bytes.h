#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <span>
#include <string_view>
#include <vector>

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
    if (order == std::endian::big) std::reverse(std::begin(bytes), std::end(bytes));
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

/// Append a number.
template <class T>
void put(Buffer& to, T value, std::endian order = std::endian::little) {
    std::byte bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof value);
    if (order == std::endian::big) std::reverse(std::begin(bytes), std::end(bytes));
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

}  // namespace splat::io
