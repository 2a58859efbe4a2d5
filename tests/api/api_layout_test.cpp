// The binary layout of the public types is the generated one: a change of a header does not compile here before
// bindings/api/generate has run. That freezes nothing, since the list follows the headers: only Bindings.Abi compares
// them with the last release, and it is skipped where abigail-tools are missing.
#include <gtest/gtest.h>

#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>

#include "splat.h"

namespace splat::test {
namespace {

static_assert(sizeof(void*) == 8, "the list is that of 64-bit machines");
static_assert(SPLAT_MAX_RANK == 8);

#define SPLAT_TYPE(type, is) \
    static_assert(std::is_same_v<type, is>, #type " is no " #is "; run bindings/api/generate");
#define SPLAT_STRUCT(type, size, align)                               \
    static_assert(sizeof(type) == (size) && alignof(type) == (align), \
                  #type " has another size or a new field; run bindings/api/generate");
#define SPLAT_FIELD(type, field, offset, size)                                        \
    static_assert(offsetof(type, field) == (offset) && sizeof(type::field) == (size), \
                  #type "." #field " moved or changed its size; run bindings/api/generate");
#include "layout.inc"
#undef SPLAT_TYPE
#undef SPLAT_STRUCT
#undef SPLAT_FIELD

TEST(ApiLayout, BuildInfoHasTheSizeOfEveryStruct) {
    std::map<std::string, std::size_t> sizes;
#define SPLAT_TYPE(type, is)
#define SPLAT_STRUCT(type, size, align) sizes[#type] = size;
#define SPLAT_FIELD(type, field, offset, size)
#include "layout.inc"
    const auto info = nlohmann::json::parse(splat_build_info());
    EXPECT_EQ(info.at("structs"), nlohmann::json(sizes));
}

}  // namespace
}  // namespace splat::test
