#ifndef SPLAT_FILM_PARAMS_H
#define SPLAT_FILM_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct FilmParams {
    uint n;
    uint c;      // channels of x
    uint p;      // pixels, h * w
    uint shift;  // 1: modulation [n, c] is a shift, no scale
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(FilmParams) <= 128);
}
#endif

#endif
