#ifndef SPLAT_FOURIER_EMBEDDING_PARAMS_H
#define SPLAT_FOURIER_EMBEDDING_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct FourierEmbeddingParams {
    uint rows;
    uint features;  // features of x
    uint waves;     // frequencies; each feature becomes as many cosines, then sines
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(FourierEmbeddingParams) <= 128);
}
#endif

#endif
