// Quads of channels that do not start at a multiple of four.

#ifndef SPLAT_CHANNELS_GLSL
#define SPLAT_CHANNELS_GLSL

// Components by, ..., by + 3 of the eight of low and high; by < 4.
vec4 shifted(vec4 low, vec4 high, uint by) {
    vec4 value = low;
    value = by == 1 ? vec4(low.yzw, high.x) : value;
    value = by == 2 ? vec4(low.zw, high.xy) : value;
    value = by == 3 ? vec4(low.w, high.xyz) : value;
    return value;
}

// Component by of a quad. Not value[by]: an index that is not a constant costs lavapipe a copy in memory.
float component(vec4 value, uint by) {
    const vec2 half_of = by < 2 ? value.xy : value.zw;
    return (by & 1u) == 0 ? half_of.x : half_of.y;
}

// The quad with the channels from `count` on set to zero; its first channel is `first`.
vec4 channels_below(vec4 value, uint first, uint count) {
    return mix(vec4(0), value, lessThan(first + uvec4(0, 1, 2, 3), uvec4(count)));
}

#endif
