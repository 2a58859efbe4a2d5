#ifndef SPLAT_POSITIONAL_EMBEDDING_PARAMS_H
#define SPLAT_POSITIONAL_EMBEDDING_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct PositionalEmbeddingParams {
    uint rows;
    uint features;   // features of x
    uint dimension;  // values per feature; half cosines, half sines
    uint swap;       // 1: exchange the halves of the result
    float ratio;     // from one frequency to the next
    uint groups_x;   // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(PositionalEmbeddingParams) <= 128);
}
#endif

#endif
