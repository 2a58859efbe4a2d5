#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace splat {

inline constexpr std::size_t kLargePageBytes = std::size_t{2} << 20;  ///< huge page of x86-64

/// Request large pages where they fit: the first touch of each page is a fault, and a gigabyte has
/// 262,144 pages of 4 KiB. Advice only: without support, or for a smaller block, nothing changes.
void advise_large_pages(void* memory, std::size_t bytes);

/// The same, and have the system fill all pages at once, for memory that is written completely.
void populate_pages(void* memory, std::size_t bytes);

/// Give the whole pages of memory back to the system: their contents are lost (on Linux the next access finds zeros).
void discard_pages(void* memory, std::size_t bytes);

/// Allocates blocks of 64 KiB or more with their pages filled. Elements created without a value are
/// undefined, so that memory is written only once.
template <class T>
class PageAllocator {
  public:
    using value_type = T;

    PageAllocator() = default;
    template <class U>
    PageAllocator(const PageAllocator<U>&) {}  // NOLINT(google-explicit-constructor)

    T* allocate(std::size_t count) {
        if (count < kMany) return std::allocator<T>().allocate(count);
        void* const memory = ::operator new(count * sizeof(T), alignment(count));
        populate_pages(memory, count * sizeof(T));
        return static_cast<T*>(memory);
    }
    void deallocate(T* memory, std::size_t count) {
        if (count < kMany) return std::allocator<T>().deallocate(memory, count);
        ::operator delete(memory, alignment(count));
    }

    template <class U>
    void construct(U* at) {
        ::new (static_cast<void*>(at)) U;
    }
    template <class U, class... Args>
    void construct(U* at, Args&&... args) {
        std::construct_at(at, std::forward<Args>(args)...);
    }

    friend bool operator==(PageAllocator, PageAllocator) { return true; }

  private:
    static constexpr std::size_t kMany = (std::size_t{64} << 10) / sizeof(T);
    static std::align_val_t alignment(std::size_t count) {
        return std::align_val_t{count * sizeof(T) < kLargePageBytes ? 4096 : kLargePageBytes};
    }
};

/// A vector of numbers that the caller writes at once: resize() leaves new ones undefined. Small ones
/// convert from and to a plain vector.
template <class T>
class LargeVector : public std::vector<T, PageAllocator<T>> {
  public:
    using Base = std::vector<T, PageAllocator<T>>;
    using Base::Base;
    // NOLINTBEGIN(google-explicit-constructor)
    LargeVector(const std::vector<T>& values) : Base(values.begin(), values.end()) {}
    operator std::vector<T>() const { return {this->begin(), this->end()}; }
    // NOLINTEND(google-explicit-constructor)

    friend bool operator==(const LargeVector& a, const LargeVector& b) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end());
    }
};

}  // namespace splat
