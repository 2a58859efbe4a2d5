#pragma once

#include <cstddef>
#include <vector>

#include "splat.h"

namespace splat::test {

struct Field {
    const char* name;
    std::size_t offset;  ///< compiled offset
    std::size_t size;
    std::size_t frozen_offset;
    std::size_t frozen_size;
};

struct Layout {
    const char* name;
    std::size_t size;  ///< compiled size
    std::size_t frozen_size;
    std::vector<Field> fields;
};

#define SPLAT_FIELD(type, field, frozen_offset, frozen_size)                           \
    Field {                                                                            \
#field, offsetof(type, field), sizeof(type::field), frozen_offset, frozen_size \
    }

}  // namespace splat::test
