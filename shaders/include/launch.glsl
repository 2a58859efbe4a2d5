// Index of this invocation in a dispatch of rows of workgroups; see src/vk/launch.h.

#ifndef SPLAT_LAUNCH_GLSL
#define SPLAT_LAUNCH_GLSL

uint invocation_index(uint groups_x) {
    const uint group = gl_WorkGroupID.y * groups_x + gl_WorkGroupID.x;
    return group * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
}

#endif
