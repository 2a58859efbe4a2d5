#pragma once

#include <array>

#include "vk/recorder.h"

namespace splat::raster {

/// A stable sort of 32-bit keys with one or two 32-bit values each; the number of entries is read on
/// the device.
struct RadixSortDesc {
    std::uint32_t capacity = 0;   ///< entries that the arrays hold, at least 1
    std::uint32_t key_bits = 32;  ///< bits that take part, from the lowest
    bool positions = false;       ///< values are the entries' positions; values[0] is not read
    bool second = false;          ///< there is a second value
    bool no_keys = false;         ///< the keys are not wanted sorted, only their values
};

/// Counters of the longest digit.
inline constexpr std::uint32_t kRadixBins = 256;

struct RadixSortViews {
    std::array<vk::BufferView, 2> keys;     ///< [capacity] uint32; keys[0] is the input
    std::array<vk::BufferView, 2> values;   ///< [capacity] uint32
    std::array<vk::BufferView, 2> seconds;  ///< [capacity] uint32, or 2 views of 16 bytes
    vk::BufferView table;                   ///< radix_sort_table_bytes
    vk::BufferView totals;                  ///< kRadixBins uint32
    vk::BufferView range;                   ///< 2 uint32, workspace: least and greatest key
    vk::BufferView entries;                 ///< uint32: number of keys
    vk::BufferView kept;                    ///< uint32, out: entries that stayed
    vk::BufferView scratch;                 ///< uint32
};

std::uint64_t radix_sort_table_bytes(const vk::Recorder& recorder, const RadixSortDesc& desc);

/// Which of keys[0], keys[1] and of the values holds the result.
std::uint32_t radix_sort_side(const vk::Recorder& recorder, const RadixSortDesc& desc);

/// Sort entries by their keys; equal keys stay in order. Keys 0xFFFFFFFF are left out and not counted
/// in `kept`. The inputs are overwritten where there are several passes.
///
/// Errors       the recorder's
/// Precision    exact
/// Determinism  bit-exact for any thread count; no atomics but minima of integers, no waiting on
///              another workgroup
/// Source       least significant digit first; a private histogram column per lane makes it stable
Status radix_sort(vk::Recorder& recorder, const RadixSortDesc& desc, const RadixSortViews& views);

}  // namespace splat::raster
