#version 460
// Decide whether a step updates the parameters: not if a gradient, a noted number that must be finite or the host's
// loss is not. One workgroup does all of it; integers and bits alone, so any order gives the same.
// Row r of the history becomes (skipped, updates of the rows up to it, numbers of gradients that are not finite, 1 if
// all are zero) and the notes. The scalars of the step become entry u of the table, u the updates of the rows before;
// marked as skipped where the step is.
// Bindings: partial results of tensor_stats [chunks, 2], notes, inputs (r, bits of the host's loss, 0, 0; then the
// table), history [rows, 1 + notes], scalars; all quads.
#extension GL_GOOGLE_include_directive : require
#include "params/optimiser_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer Partial { uvec4 partial[]; };
layout(set = 0, binding = 1, std430) readonly buffer Notes { uvec4 notes[]; };
layout(set = 0, binding = 2, std430) readonly buffer Inputs { uvec4 inputs[]; };
layout(set = 0, binding = 3, std430) buffer History { uvec4 history[]; };  // accumulates
layout(set = 0, binding = 4, std430) writeonly buffer Scalars { uvec4 scalars[]; };
layout(push_constant) uniform Push { StepDecisionParams params; };

shared uint broken_all;  // gradients that are not finite
shared uint moved_any;   // a gradient is not zero
shared uint bad_any;     // a noted number is not finite

const uint kOne = 0x3F800000u;  // bits of 1.0

uvec4 magnitude(uvec4 bits) { return bits & 0x7FFFFFFFu; }

bool all_finite(uvec4 bits) { return all(lessThan(magnitude(bits), uvec4(0x7F800000u))); }

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uint lanes = gl_WorkGroupSize.x;
    if (lane == 0) broken_all = moved_any = bad_any = 0;
    barrier();
    uint broken = 0;
    bool moved = false;
    for (uint i = lane; i < params.chunks; i += lanes) {
        const uvec4 counts = partial[2 * i + 1];
        broken += counts.y + counts.z;
        moved = moved || any(notEqual(magnitude(partial[2 * i]).xy, uvec2(0)));
    }
    bool bad = false;
    for (uint i = lane; i < params.checked; i += lanes)
        bad = bad || (i % params.block >= params.unchecked && !all_finite(notes[i]));
    if (broken > 0) atomicAdd(broken_all, broken);
    if (moved) atomicOr(moved_any, 1u);
    if (bad) atomicOr(bad_any, 1u);
    barrier();

    const uint row = inputs[0].x;
    const bool skipped = broken_all > 0 || bad_any != 0 || !all_finite(inputs[0].yyyy);
    const uint at = row * (1 + params.notes);
    const uint updates = row == 0 ? 0 : history[at - 1 - params.notes].y;
    const uint entry = 1 + min(updates, params.rows - 1) * params.entry;
    for (uint i = lane; i < params.entry; i += lanes) {
        uvec4 quad = inputs[entry + i];
        const bool ema = i + 1 == params.entry;
        if (skipped && (ema || (i & 1) == 1)) quad.w = kOne;
        scalars[ema ? params.ema_at : i] = quad;
    }
    for (uint i = lane; i < params.notes; i += lanes) history[at + 1 + i] = notes[i];
    if (lane == 0)
        history[at] = uvec4(skipped ? 1 : 0, updates + (skipped ? 0 : 1), broken_all,
                            moved_any == 0 && broken_all == 0 ? 1 : 0);
}
