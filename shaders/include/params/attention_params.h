#ifndef SPLAT_ATTENTION_PARAMS_H
#define SPLAT_ATTENTION_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kAttentionColumnsId = 10u;  // fast product: columns of an invocation
SPLAT_SPEC_ID kAttentionBlocksId = 11u;   // fast product: blocks of 8 rows of an invocation
SPLAT_SPEC_ID kAttentionQuadsId = 13u;    // fused forward: quads of channels of a head
SPLAT_SPEC_ID kAttentionOtherId = 12u;    // product: one of the following
const uint kAttentionNoOther = 0u;
const uint kAttentionAddsOther = 1u;   // y = product + other, which lies as y and may be its memory
const uint kAttentionTimesOther = 2u;  // y = product * other, a quad for each column of each image and head

// One batched stage; quads of the operands lie at *_from + image * *_image + head * *_head + quad * *_stride.
struct AttentionParams {
    uint m;  // rows of the result, in its quads
    uint n;  // columns
    uint k;  // inner dimension; of a softmax, the keys
    uint heads;
    uint s_from;
    uint s_stride;
    uint s_head;
    uint s_image;
    uint v_from;
    uint v_stride;
    uint v_head;
    uint v_image;
    uint y_from;
    uint y_stride;
    uint y_head;
    uint y_image;
    float scale;  // multiplies the result
};

#ifdef __cplusplus
static_assert(sizeof(AttentionParams) <= 128);
}
#endif

#endif
