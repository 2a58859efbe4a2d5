// Lengths of rotations, also where squares overflow.

#ifndef SPLAT_QUATERNION_GLSL
#define SPLAT_QUATERNION_GLSL

const float kShrink80 = 8.2718061e-25;  // 2^-80

bool squares_fit(vec4 q) { return dot(q, q) < 1e37; }

vec4 shrunk(vec4 q) { return squares_fit(q) ? q : q * kShrink80; }

float norm_of(vec4 q) {
    const vec4 small = shrunk(q);
    return sqrt(dot(small, small)) * (squares_fit(q) ? 1.0 : 1.0 / kShrink80);
}

#endif
