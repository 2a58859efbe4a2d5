#pragma once

#include <array>

#include "vk/recorder.h"

namespace splat::raster {

/// A stable sort of entries: a 32-bit key and a 32-bit value, next to each other, so that one store
/// moves both, and perhaps a second value. Their number is read on the device.
struct RadixSortDesc {
    std::uint32_t capacity = 0;   ///< entries that the arrays hold, 1 to kMaxSorted
    std::uint32_t key_bits = 32;  ///< bits that take part, from the lowest; 2 at least
    bool second = false;          ///< there is a second value; key_bits < 32
};

/// Most entries: one invocation sums the counters of all chunks, 2048 of 2^16 entries on CPU devices,
/// where it takes a turn for each 8 of them twice for each 32 of 512 digits, 8192 of 2^14 with other
/// kernels.
inline constexpr std::uint32_t kMaxSorted = 1U << 27;

/// Counters of the longest digit where `totals` are kept.
inline constexpr std::uint32_t kRadixBins = 256;

struct RadixSortViews {
    vk::BufferView input;                   ///< [capacity,2] uint32: key, value
    std::array<vk::BufferView, 2> sides;    ///< [capacity,2] uint32: passes write them in turns,
                                            ///< sides[1] may be the input if key_bits < 32
    std::array<vk::BufferView, 2> seconds;  ///< [capacity] uint32, or 2 views of 16 bytes: those
                                            ///< of `sides`; seconds[1] is the input
    vk::BufferView table;                   ///< radix_sort_table_bytes, workspace
    vk::BufferView places;                  ///< as `table`; this and the next for kernels for CPU
    vk::BufferView ranks;                   ///< devices alone: radix_sort_rank_bytes
    vk::BufferView totals;                  ///< kRadixBins uint32; for the others
    vk::BufferView range;                   ///< 2 uint32, workspace: least key, least ~key
    vk::BufferView count;                   ///< uint32: number of entries
    vk::BufferView kept;                    ///< uint32, out: entries that stayed
};

std::uint64_t radix_sort_table_bytes(const vk::Recorder& recorder, const RadixSortDesc& desc);
std::uint64_t radix_sort_rank_bytes(const vk::Recorder& recorder, const RadixSortDesc& desc);

/// Which of the sides, and of the second values, holds the result.
std::uint32_t radix_sort_side(const vk::Recorder& recorder, const RadixSortDesc& desc);

/// Sort entries by their keys; equal keys stay in order. Keys 0xFFFFFFFF are left out and not counted
/// in `kept`.
///
/// Errors       the recorder's
/// Precision    exact
/// Determinism  bit-exact for any thread count; no atomics but minima of integers, no waiting on
///              another workgroup
/// Source       least significant digit first; a histogram per lane makes it stable
Status radix_sort(vk::Recorder& recorder, const RadixSortDesc& desc, const RadixSortViews& views);

}  // namespace splat::raster
