#version 460
// y[i] = x[index[i]] for rows of kLength elements, or fresh[i] where the index is of a new row; zeros unless kFresh
// is set. The length is a constant, because lavapipe divides vectors of integers one by one. One invocation copies
// one element. Bindings: index, x, fresh, y, all arrays of uint.
// Specialisation: kLength, kFresh.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/optimiser_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kGatherRowsLengthId) const uint kLength = 1;
layout(constant_id = kGatherRowsFreshId) const bool kFresh = false;
UINTS(0, index);
UINTS(1, x);
UINTS(2, fresh);
layout(set = 0, binding = 3, std430) writeonly buffer Y { uint y[]; };
layout(push_constant) uniform Push { GatherRowsParams params; };

#include "launch.glsl"

const uint kNewRow = 0xFFFFFFFFu;  // the same in src/ops/gather_rows.h

void main() {
    const uint at = invocation_index(params.groups_x);
    if (at >= params.words) return;
    const uint i = at / kLength;
    const uint row = LD1(index, i);
    uint value = 0;
    if (row != kNewRow)
        value = LD1(x, row * kLength + (at - i * kLength));
    else if (kFresh)
        value = LD1(fresh, at);
    y[at] = value;
}
