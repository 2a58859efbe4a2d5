// Indices of a workgroup's invocations in the order of subgroups, then lanes. Vulkan does not relate these to
// gl_LocalInvocationID, and a subgroup may have idle lanes. A subgroup takes consecutive indices from its first.
// Needs the shared array ORDER_SCRATCH of an element for each subgroup. Every invocation must call.

#ifndef SPLAT_ORDERED_INDEX_GLSL
#define SPLAT_ORDERED_INDEX_GLSL

uint ordered_index() {
    const uvec4 present = subgroupBallot(true);
    if (subgroupElect()) ORDER_SCRATCH[gl_SubgroupID] = subgroupBallotBitCount(present);
    barrier();
    uint index = subgroupBallotExclusiveBitCount(present);
    for (uint s = 0; s < gl_SubgroupID; ++s) index += ORDER_SCRATCH[s];
    barrier();
    return index;
}

#endif
