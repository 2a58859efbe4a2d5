#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/status.h"

namespace splat {

/// FNV-1a of 64 bits. Source: the IETF draft draft-eastlake-fnv.
class Hash {
  public:
    void add(const void* data, std::size_t bytes) {
        const auto* at = static_cast<const unsigned char*>(data);
        for (std::size_t i = 0; i < bytes; ++i) value_ = (value_ ^ at[i]) * 0x100000001B3U;
    }
    void add(std::string_view text) { add(text.data(), text.size()); }
    template <class T>
    void add_number(const T& number) {
        add(&number, sizeof number);
    }
    [[nodiscard]] std::uint64_t value() const { return value_; }
    /// 16 hexadecimal digits.
    [[nodiscard]] std::string text() const { return format("%016llx", llu(value_)); }

  private:
    std::uint64_t value_ = 0xCBF29CE484222325U;
};

}  // namespace splat
