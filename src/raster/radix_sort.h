#pragma once

#include <array>

#include "vk/context.h"

namespace splat::raster {

/// A stable sort. An entry is a 32-bit key next to a 32-bit value, which one store moves together,
/// and optionally a second value. The kernels read the number of entries on the device.
struct RadixSortDesc {
    std::uint32_t capacity = 0;   ///< entries that the arrays hold, 1 to kMaxSorted
    std::uint32_t key_bits = 32;  ///< lowest bits of the key to sort by
    bool second = false;          ///< there is a second value; key_bits < 32
};

/// Most entries: plain kernels sum the counters of all chunks in one loop of an invocation. On CPU devices these
/// are 2048 chunks of 2^16 entries (8 chunks a turn, twice for every 32 of 512 digits), elsewhere
/// 8192 of 2^14.
inline constexpr std::uint32_t kMaxSorted = 1U << 27;

/// Entries of an array that holds `capacity`: kernels read four at a time.
constexpr std::uint64_t radix_sort_entries(std::uint64_t capacity) {
    return (capacity + 3) / 4 * 4;
}

struct RadixSortViews {
    vk::BufferView input;                   ///< [radix_sort_entries(capacity),2] uint32: key, value
    std::array<vk::BufferView, 2> sides;    ///< like the input: passes write them in turn;
                                            ///< sides[1] may be the input if key_bits < 32
    std::array<vk::BufferView, 2> seconds;  ///< [capacity] uint32 if desc.second: second values of
                                            ///< `sides`; seconds[1] is the input
    vk::BufferView count;                   ///< uint32: number of entries
    vk::BufferView kept;                    ///< uint32, out: entries not left out
};

/// Device memory of a sort besides its entries. Sorts that run one after the other may share it.
struct RadixSortWorkspace {
    vk::Buffer table;      ///< one counter per lane and value of a digit
    vk::Buffer places;     ///< where the entries of each counter go; kernels for CPUs only
    vk::Buffer ranks;      ///< 16 bits per entry; kernels for CPUs only
    vk::Buffer totals;     ///< one counter per value of a digit; other kernels
    vk::Buffer range;      ///< 2 uint32: least key, least ~key
    vk::Buffer unused[2];  ///< bound if there are no second values

    [[nodiscard]] std::uint64_t bytes() const;
};

/// Memory for sorts of desc.capacity and at most desc.key_bits. Errors: those of Memory::allocate.
Result<RadixSortWorkspace> allocate_radix_sort(vk::Context& context, const RadixSortDesc& desc);

/// Index of the sides, and of the second values, that hold the result.
std::uint32_t radix_sort_side(const vk::Recorder& recorder, const RadixSortDesc& desc);

/// Sort entries by their keys; equal keys stay in order. Entries with the key 0xFFFFFFFF are left
/// out and not counted in `kept`.
///
/// Errors       the recorder's
/// Precision    exact
/// Determinism  bit-exact for any thread count: the only atomics are integer minima, and no
///              workgroup waits for another
/// Source       least significant digit first; a histogram per lane makes it stable
Status radix_sort(vk::Recorder& recorder, const RadixSortDesc& desc, const RadixSortViews& views,
                  const RadixSortWorkspace& space);

}  // namespace splat::raster
