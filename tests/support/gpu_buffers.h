#pragma once

#include <cstdint>
#include <vector>

#include "vk/context.h"

namespace splat::test {

/// Device memory of `elements` 4-byte elements, freshly poisoned. Aborts the process if it cannot be
/// allocated, as nothing could be tested.
vk::Buffer device_buffer(vk::Context& context, std::size_t elements);

/// The same, holding `values`.
vk::Buffer upload(vk::Context& context, const std::vector<float>& values);
vk::Buffer upload(vk::Context& context, const std::vector<std::uint32_t>& values);

/// The first `elements` elements. Fails the test if reading fails.
std::vector<float> download(vk::Context& context, const vk::BufferView& view, std::size_t elements);
std::vector<std::uint32_t> download_words(vk::Context& context, const vk::BufferView& view,
                                          std::size_t elements);

}  // namespace splat::test
