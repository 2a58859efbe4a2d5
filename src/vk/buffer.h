#pragma once

#include <cstdint>
#include <utility>

#include "core/shape.h"
#include "vk/device.h"

namespace splat::vk {

struct Block;
class Memory;

/// A byte range of device memory with a shape; does not own it. Elements are 4 bytes (float32,
/// int32 or uint32).
struct BufferView {
    Block* block = nullptr;
    VkBuffer buffer = VK_NULL_HANDLE;
    std::uint64_t offset = 0;  ///< bytes from the start of `buffer`
    std::uint64_t bytes =
        0;  ///< a multiple of 16, so that whole quads can be read; >= 4 * shape.elements()
    Shape shape;

    [[nodiscard]] std::uint64_t end() const { return offset + bytes; }
    /// `count` bytes of it, from byte `first`.
    [[nodiscard]] BufferView part(std::uint64_t first, std::uint64_t count) const {
        BufferView view = *this;
        view.offset += first;
        view.bytes = count;
        return view;
    }
    [[nodiscard]] bool overlaps(const BufferView& other) const {
        return buffer == other.buffer && offset < other.end() && other.offset < end();
    }
    [[nodiscard]] bool same_range(const BufferView& other) const {
        return buffer == other.buffer && offset == other.offset && bytes == other.bytes;
    }
};

/// Owns a range of device memory; frees it when destroyed.
class Buffer {
  public:
    Buffer() = default;
    Buffer(Memory* memory, BufferView range) : memory_(memory), range_(range) {}
    Buffer(Buffer&& other) noexcept
        : memory_(std::exchange(other.memory_, nullptr)), range_(std::exchange(other.range_, {})) {}
    Buffer& operator=(Buffer&& other) noexcept {
        std::swap(memory_, other.memory_);
        std::swap(range_, other.range_);
        return *this;
    }
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;
    ~Buffer();

    [[nodiscard]] std::uint64_t bytes() const { return range_.bytes; }

    /// The whole range as a one-dimensional view.
    [[nodiscard]] const BufferView& range() const { return range_; }

    /// `shape` from the start of the buffer. The buffer must be large enough.
    [[nodiscard]] BufferView view(const Shape& shape) const;

  private:
    Memory* memory_ = nullptr;
    BufferView range_;
};

/// Bytes that `elements` 4-byte elements take in a view: whole quads of 16 bytes.
constexpr std::uint64_t quad_bytes(std::uint64_t elements) {
    return (elements * 4 + 15) / 16 * 16;
}

}  // namespace splat::vk
