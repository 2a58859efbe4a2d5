#pragma once

#include <array>

#include "vk/context.h"

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

struct RadixSortViews {
    vk::BufferView input;                   ///< [capacity,2] uint32: key, value
    std::array<vk::BufferView, 2> sides;    ///< [capacity,2] uint32: passes write them in turns,
                                            ///< sides[1] may be the input if key_bits < 32
    std::array<vk::BufferView, 2> seconds;  ///< [capacity] uint32, unread without desc.second:
                                            ///< those of `sides`; seconds[1] is the input
    vk::BufferView count;                   ///< uint32: number of entries
    vk::BufferView kept;                    ///< uint32, out: entries that stayed
};

/// Device memory that a sort needs beside its entries. Sorts may share it, one after the other.
struct RadixSortWorkspace {
    vk::Buffer table;      ///< counters of each lane, a digit's values each
    vk::Buffer places;     ///< where each counter's entries begin; kernels for CPU devices alone
    vk::Buffer ranks;      ///< 16 bits for each entry; kernels for CPU devices alone
    vk::Buffer totals;     ///< counters of the longest digit; the other kernels
    vk::Buffer range;      ///< 2 uint32: least key, least ~key
    vk::Buffer unused[2];  ///< bound where there are no second values

    [[nodiscard]] std::uint64_t bytes() const;
};

/// For sorts with desc.capacity and keys of at most desc.key_bits. Errors: those of Memory::allocate.
Result<RadixSortWorkspace> allocate_radix_sort(vk::Context& context, const RadixSortDesc& desc);

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
Status radix_sort(vk::Recorder& recorder, const RadixSortDesc& desc, const RadixSortViews& views,
                  const RadixSortWorkspace& space);

}  // namespace splat::raster
