#ifndef SPLAT_RADIX_SORT_PARAMS_H
#define SPLAT_RADIX_SORT_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kRadixSortBitsId = 10u;          // most bits of a digit
SPLAT_SPEC_ID kRadixSortSecondId = 11u;        // each entry has a second value
SPLAT_SPEC_ID kRadixSortRangedId = 12u;        // digits by the range of the keys
SPLAT_SPEC_ID kRadixSortMaxSubgroupsId = 13u;  // most subgroups of a workgroup

struct RadixSortParams {
    uint capacity;  // entries that the arrays hold
    uint lanes;     // each has a histogram and sorts a contiguous chunk of the entries
    uint least;     // least lanes that take part
    uint chunk;     // entries per lane, until all lanes take part
    uint pass;
    uint passes;
};

#ifdef __cplusplus
static_assert(sizeof(RadixSortParams) <= 128);
}
#endif

#endif
