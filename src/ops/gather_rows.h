#pragma once

#include "vk/recorder.h"

namespace splat::ops {

/// In an index: the row of `fresh`.
inline constexpr std::uint32_t kNewRow = 0xFFFFFFFF;

struct GatherRowsDesc {
    std::uint32_t rows = 0;    ///< rows of y
    std::uint32_t length = 1;  ///< 4-byte elements of a row
};

/// Take rows of one array by an index, and others from their own place.
///
///   y[i] = x[index[i]], or fresh[i] where index[i] is kNewRow      i < rows
///
/// index        [rows] uint32; x has every row that it names
/// x, fresh, y  rows of `length` elements; y aliases neither; `fresh` without a buffer: zeros
/// Errors       kShape if index, fresh or y is too short; the recorder's beyond the device's binding limits;
///              nothing is recorded on error
/// Precision    exact, bit for bit
/// Determinism  bit-exact for any thread count
/// Source       shaders/ops/gather_rows.comp
Status gather_rows(vk::Recorder& recorder, const GatherRowsDesc& desc, const vk::BufferView& index,
                   const vk::BufferView& x, const vk::BufferView& fresh, const vk::BufferView& y);

}  // namespace splat::ops
